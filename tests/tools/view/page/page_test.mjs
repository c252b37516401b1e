// The page in Chromium with a flight of the real programs: node --test page_test.mjs, with the build folder in SLS_BUILD.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { startFlight } from "../flight.mjs";
import { kLean, open, readPixels, startBrowser, waitFor } from "./browser.mjs";

const kColours = { quad: [0x1f, 0x84, 0xd6], load: [0xe0, 0x86, 0x00] };
const kTolerance = 6; // of 255: a smooth edge is far from it, a rounded colour is not
const kReach = 4; // pixels around the centre of a body that are looked at
const kFewest = 10; // of 81 pixels there have its colour,
const kFarthest = 3; // and their mean is as near to its centre, in pixels

let chromium, flight;
before(async () => {
  chromium = await startBrowser({ flags: kLean });
  flight = await startFlight();
});
after(async () => {
  await chromium?.stop();
  await flight?.stop();
});

const state = (page) => page.evaluate(() => window.slsView.state());
const untilFlies = (page, step = 0) =>
  waitFor(`a step after ${step}`, () => page.evaluate((last) => (window.slsView?.state().step ?? 0) > last, step));

/** Starts a viewer, runs `body` with its page in a tab, ends both. Expects no other error in the console than `expected`,
 *  and no request to another server. */
async function withPage(flags, tab, body, { on = flight, hash = "", browser = chromium.browser, expected = /^$/ } = {}) {
  const viewer = await on.startViewer(...flags);
  const { page, errors, requests, close } = await open(browser, tab);
  try {
    await page.goto(viewer.url + hash);
    await body(page, { viewer, requests });
    assert.deepEqual(errors.filter((text) => !expected.test(text)), []);
    for (const url of requests)
      assert.ok(url.startsWith("data:") || new URL(url).host === new URL(viewer.url).host, `foreign request: ${url}`);
  } finally {
    await close();
    await viewer.stop();
  }
}

/** Clicks as a user does: on a button that can be pressed. Waits for the reply, which must say that the request was carried out. */
async function press(page, action, button = `[data-action=${action}]`) {
  await waitFor(`${action} can be pressed`, () => page.$eval(`[data-action=${action}]`, ({ disabled, hidden }) => !disabled && !hidden));
  await page.click(button);
  await expectDone(page, action);
}
async function expectDone(page, action) {
  const reply = await waitFor(`reply to ${action}`, () =>
    page.$eval("#reply", ({ textContent }, word) => new RegExp(`^${word} (done|refused|not)`).test(textContent) && textContent, action));
  assert.match(reply, /^\w+ done at step \d+$/);
}
async function stepOn(page, count) {
  const last = flight.status().step + count;
  await page.$eval("#bar input[type=number]", (field, value) => (field.value = value), String(count));
  await press(page, "step");
  await waitFor(`${count} steps`, () => flight.status().step === last);
}

/** The recorded positions of quadrotor and load at `step`; nothing if that row is not on the disk yet. */
function readRecorded(step, { folder } = flight) {
  const [header, ...rows] = readFileSync(join(folder, "recording/state.csv"), "utf8").trimEnd().split("\n").map((line) => line.split(","));
  const row = rows.find((fields) => Number(fields[header.indexOf("step")]) === step);
  const read = (part) => ["x", "y", "z"].map((axis) => Number(row[header.indexOf(`${part}_${axis}_m`)]));
  return row && { quad: read("quad"), load: read("load") };
}

/**
 * Pixel of a point of W in the drawings to scale, from their definition alone: `top` has y to the right and x up,
 * `side` has x to the right and height up.
 */
function projectFlat({ mode, target_m: [tx, ty, tz], height_m, area }, [x, y, z]) {
  const scale = area.height / height_m;
  const [right, up] = mode === "top" ? [y - ty, x - tx] : [x - tx, tz - z];
  return [area.left + area.width / 2 + right * scale, area.top + area.height / 2 - up * scale];
}

/** The part whose colour a picture of the paused step does not show where the recording has it; nothing if it shows both. */
async function findMissing(page, mode) {
  await page.click(`[data-camera=${mode}]`);
  await page.click("#fit");
  const frames = await page.evaluate(() => window.slsView.frames());
  await page.evaluate(() => window.slsView.redraw());
  await waitFor("a new frame", async () => (await page.evaluate(() => window.slsView.frames())) > frames);
  const { step } = await state(page);
  const recorded = await waitFor("the recorded step", () => readRecorded(step));
  const camera = await page.evaluate(() => window.slsView.camera());
  const png = await page.screenshot();
  // From above the quadrotor hides the load.
  for (const part of mode === "top" ? ["quad"] : ["quad", "load"]) {
    const [x, y] = projectFlat(camera, recorded[part]);
    // Lines of path, trail and reference may cross the body: then they cover a part of it, not all, and none of one side alone.
    const places = [];
    for (let down = -kReach; down <= kReach; ++down) for (let right = -kReach; right <= kReach; ++right) places.push([right, down]);
    const colours = await readPixels(chromium.browser, png, places.map(([right, down]) => [x + right, y + down]));
    const shown = places.filter((_, i) => colours[i].every((value, channel) => Math.abs(value - kColours[part][channel]) <= kTolerance));
    const [off, low] = [0, 1].map((axis) => shown.reduce((sum, place) => sum + place[axis], 0) / shown.length);
    if (shown.length < kFewest || Math.hypot(off, low) > kFarthest) {
      return `${mode}: ${part} at ${[x, y]}: expected ${kFewest} pixels of ${kColours[part]} around it, got ${shown.length} around ${[off, low]}`;
    }
  }
  return null;
}

test("buttons and keys pause, step and resume the run, and pixels show where it is", async () => {
  await withPage([], {}, async (page) => {
    await untilFlies(page, 250);
    await press(page, "pause");
    await waitFor("sim_ctl: paused", () => flight.status().phase === "paused");
    await waitFor("page: paused", async () => (await state(page)).phase === "paused");
    await stepOn(page, 7);
    for (const mode of ["top", "side"]) {
      // Where path, trail and reference cross, lines cover most of a body: then a later step shows it.
      let missing = await findMissing(page, mode);
      if (missing) {
        await stepOn(page, 100);
        missing = await findMissing(page, mode);
      }
      assert.equal(missing, null);
    }
    await page.focus("#scene");
    await page.keyboard.press("Space");
    await expectDone(page, "resume");
    await waitFor("sim_ctl: running", () => flight.status().phase === "running");
    const { run_id } = flight.status();
    await page.click("[data-action=stop]");
    await page.click("#confirm-no");
    await page.click("[data-action=reset]");
    await press(page, "reset", "#confirm-yes");
    await waitFor("another run", () => flight.status().run_id !== run_id);
  });
});

test("a connection that is lost is found again without reload, and the picture stays", async () => {
  await withPage([], {}, async (page, { viewer }) => {
    await untilFlies(page);
    await page.evaluate(() => (window.isSamePage = true));
    await viewer.stop();
    await waitFor("banner", () => page.$eval("#banner", ({ hidden, textContent }) => !hidden && /lost/.test(textContent)));
    assert.equal(await page.$eval("[data-action=pause]", ({ disabled }) => disabled), true);
    assert.ok(await page.evaluate(() => window.slsView.projection(0)));
    const { step } = await state(page);
    const second = await flight.startViewer("--port", viewer.port);
    try {
      await untilFlies(page, step);
      assert.equal(await page.$eval("#banner", ({ hidden }) => hidden), true);
      assert.equal(await page.evaluate(() => window.isSamePage), true);
    } finally {
      await second.stop();
    }
  }, { expected: /WebSocket|ERR_CONNECTION|ERR_EMPTY_RESPONSE/ }); // EMPTY: of a request in work when the viewer ends
});

test("a fleet of 100 is drawn, and a click chooses a vehicle", async (t) => {
  const fleet = await startFlight({ base: "fleet", change: (text) => text.replace("vehicles: 10", "vehicles: 100"), rtf: 0.05 });
  t.after(fleet.stop);
  await withPage([], {}, async (page) => {
    await untilFlies(page);
    await page.evaluate(() => {
      const { send } = WebSocket.prototype;
      window.sent = [];
      WebSocket.prototype.send = function (text) {
        window.sent.push(JSON.parse(text));
        send.call(this, text);
      };
    });
    await press(page, "pause");
    await page.click("[data-camera=top]");
    await page.mouse.click(...await waitFor("its place", () => page.evaluate(() => window.slsView.projection(42)?.quad)));
    await waitFor("vehicle 42", async () => (await state(page)).selected === 42);
    assert.ok(await page.evaluate(() => window.sent.some(({ op, vehicle_id }) => op === "select" && vehicle_id === 42)));
  }, { on: fleet });
});

test("no flight: the page says what is missing, with the command", async (t) => {
  const nothing = await startFlight({ hasFlight: false });
  t.after(nothing.stop);
  await withPage([], {}, async (page) => {
    await waitFor("command", () => page.$eval("#command", ({ textContent }) => textContent.startsWith("./sls run")));
  }, { on: nothing });
});

test("no WebGL: a table of positions and the plots", async (t) => {
  const flat = await startBrowser({ flags: [...kLean, "--disable-3d-apis"] });
  t.after(flat.stop);
  const check = async (page) => {
    await untilFlies(page);
    assert.equal((await state(page)).has_scene, false);
    await waitFor("numbers in the table", () => page.$eval("#table tbody td:nth-child(2)", ({ textContent }) => /\d/.test(textContent)));
    await waitFor("a plot", () => page.$("#plots canvas"));
    // A weight in z would flatten x and y.
    const titles = await page.$$eval(".plot-title", (all) => all.map(({ textContent }) => textContent));
    for (const title of ["Force x, y", "Force z"]) assert.ok(titles.includes(title), title);
  };
  await withPage([], {}, check, { expected: /./, browser: flat.browser });
});

test("without the token there are no buttons; it leaves the address and is in no request", async () => {
  const token = "a-token-of-the-test-0123";
  const file = join(flight.folder, "token");
  writeFileSync(file, token, { mode: 0o600 });
  await withPage(["--token-file", file], {}, async (page, { viewer, requests }) => {
    await waitFor("buttons", () => page.$("[data-action=pause]"));
    assert.equal(page.url(), viewer.url);
    assert.ok(requests.some((url) => url.startsWith("ws:")));
    assert.deepEqual(requests.filter((url) => url.includes(token)), []);
  }, { hash: `#token=${token}` });
  await withPage(["--token-file", file], {}, async (page) => {
    await waitFor("reason", () => page.$eval("#bar", ({ textContent }) => /expected a token/.test(textContent)));
    assert.equal(await page.$("[data-action]"), null);
    await page.type("#bar input", token);
    await page.click("#bar button");
    await waitFor("buttons", () => page.$("[data-action=pause]"));
  });
  await withPage(["--read-only"], {}, async (page) => {
    await waitFor("reason", () => page.$eval("#bar", ({ textContent }) => /--read-only/.test(textContent)));
    assert.equal(await page.$("[data-action]"), null);
  });
});

test("a phone shows everything without scrolling sideways, and every control has a name", async () => {
  await withPage([], { width: 390, height: 844, touch: true, scheme: "light" }, async (page) => {
    await untilFlies(page);
    assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= 390);
    const nameless = await page.$$eval("button, select, input, summary", (all) =>
      all.filter((item) => !(item.getAttribute("aria-label") || item.textContent.trim() || item.labels?.length)).length);
    assert.equal(nameless, 0);
  });
});

test("a page opened in a pause shows what was flown before, and at the end the whole recording", async (t) => {
  const paused = await startFlight({ rtf: 0.4 });
  t.after(paused.stop);
  await waitFor("a flight", () => paused.status().step > 0);
  const expectWhole = (times, end) =>
    assert.deepEqual(times.map((time) => Math.round(time / 0.004)), Array.from({ length: end + 1 }, (_, step) => step));
  const readTimes = (page) => page.evaluate(() => window.slsView.plotted());
  const readText = (page, place) => page.$eval(place, ({ dataset, textContent }) => `${dataset.kind} ${textContent}`);
  await withPage(["--recording", join(paused.folder, "none")], {}, async (page) => {
    await untilFlies(page, 100);
    await waitFor("why not", async () => /Earlier steps.*none: expected the recording of run/.test(await readText(page, "#status")));
    await press(page, "pause");
  }, { on: paused });
  await withPage(["--recording", paused.folder], {}, async (page, { viewer }) => {
    const { step } = await waitFor("the pose of the recording", async () => (await state(page)).step && state(page));
    expectWhole(await readTimes(page), step);
    const pose = await page.evaluate(() => window.slsView.pose(0));
    for (const part of ["quad", "load"])
      pose[part].forEach((value, axis) => assert.ok(Math.abs(value - readRecorded(step, paused)[part][axis]) < 1e-6, `${part} ${value}`));
    await press(page, "resume");
    await untilFlies(page, step + 100);
    const second = await open(chromium.browser);
    await second.page.goto(viewer.url);
    await untilFlies(second.page, step + 200);
    const times = await waitFor("the history", async () => (await readTimes(second.page)).length > step + 100 && readTimes(second.page));
    expectWhole(times.slice(0, step + 100), step + 99);
    await second.close();
    await page.click("[data-action=stop]");
    await page.click("#confirm-yes");
    await waitFor("replay", () => page.$("#time"));
    assert.match(await readText(page, "#banner"), new RegExp(`^note .*its recording; ./sls view ${join(paused.folder, "recording")} shows`));
    const end = readFileSync(join(paused.folder, "recording/state.csv"), "utf8").trimEnd().split("\n").length - 2;
    expectWhole(await readTimes(page), end);
  }, { on: paused });
});

test("after the end of a flight the page replays it, also without sls_view", async (t) => {
  const ended = await startFlight();
  t.after(ended.stop);
  await withPage([], { scheme: "light" }, async (page, { viewer }) => {
    await untilFlies(page, 500);
    await page.click("#table-toggle");
    assert.notEqual(...(await page.$eval("#table-toggle", (button) => ["color", "backgroundColor"].map((name) => getComputedStyle(button)[name]))));
    assert.doesNotMatch(await page.$eval("#events", ({ textContent }) => textContent), /not ready/);
    for (const name of ["Rows to", "Published → drawn"])
      assert.ok(await page.$$eval("th, dt", (all, wanted) => all.find(({ textContent }) => textContent === wanted)?.title, name), name);
    await page.click("[data-action=stop]");
    await page.click("#confirm-yes");
    await waitFor("replay", () => page.$("#time"));
    await viewer.stop();
    assert.match(await page.$eval("#banner", ({ dataset, textContent }) => `${dataset.kind} ${textContent}`), /^note .*received .recordings: expected.*sls view DIR/);
    const { pose, step } = await page.evaluate(() => {
      const { min, max } = document.getElementById("time");
      // The received time nearest to the middle: a page that gets no processor time misses rows, and shows a mean between two.
      const middle = (Number(min) + Number(max)) / 2;
      const time = window.slsView.plotted().reduce((best, at) => (Math.abs(at - middle) < Math.abs(best - middle) ? at : best));
      window.slsView.seek(time);
      return { pose: window.slsView.pose(0), step: Math.round(time / 0.004) }; // of a period of 4 ms
    });
    const recorded = readRecorded(step, ended);
    for (const part of ["quad", "load"])
      pose[part].slice(0, 3).forEach((value, axis) => assert.ok(Math.abs(value - recorded[part][axis]) < 1e-3, `${part} ${value}`));
  }, { on: ended, expected: /WebSocket|ERR_CONNECTION/ });
});
