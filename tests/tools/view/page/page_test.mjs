// The page in Chromium with a fake server and a flight from closed forms: node page_test.mjs PAGE_HTML FOLDER [WORD]
// PAGE_HTML: the built page; FOLDER: for screenshots; WORD: run only tests with this word in their name.
import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { kLean, open, readPixels, startBrowser, waitFor } from "./browser.mjs";
import { calcLoad, calcQuad, startFakeServer } from "./fake_server.mjs";

const [html, folder, word = ""] = process.argv.slice(2);
mkdirSync(folder, { recursive: true });

const kQuad = [0x1f, 0x84, 0xd6];
const kLoad = [0xe0, 0x86, 0x00];
const kTolerance = 6; // of 255: a smooth edge is far from it, a rounded colour is not

const state = (page) => page.evaluate(() => window.slsView.state());
const untilFlies = (page) => waitFor("poses", () => page.evaluate(() => (window.slsView?.state().step ?? 0) > 0));
const isColour = (pixel, expected) => pixel.every((value, index) => Math.abs(value - expected[index]) <= kTolerance);

const chromium = await startBrowser({ flags: kLean });

/** Starts a server, runs `body` with the page in a tab, ends both. Expects no console error and no request to another server. */
async function withPage(serverOptions, tabOptions, body, { mayWarn = false, hash = "", browser = chromium.browser } = {}) {
  const server = await startFakeServer({ page: html, ...serverOptions });
  const { page, errors, requests, close } = await open(browser, tabOptions);
  try {
    await page.goto(server.url + hash, { waitUntil: "load" });
    await body(page, server);
    if (!mayWarn) assert.deepEqual(errors, []);
    for (const url of requests) assert.ok(url.startsWith(server.url) || url.startsWith("data:"), `foreign request: ${url}`);
  } finally {
    await close();
    await server.stop();
  }
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

const tests = {
  async "pixels show quadrotor and load where the closed form has them"() {
    await withPage({}, {}, async (page, server) => {
      await untilFlies(page);
      const step = 500;
      server.freeze(step);
      await waitFor("the frozen step", async () => (await state(page)).step === step);
      for (const mode of ["top", "side"]) {
        await page.click(`[data-camera=${mode}]`);
        const frames = await page.evaluate(() => window.slsView.frames());
        await page.evaluate(() => window.slsView.redraw());
        await waitFor("a new frame", async () => (await page.evaluate(() => window.slsView.frames())) > frames);
        const camera = await page.evaluate(() => window.slsView.camera());
        const png = await page.screenshot({ path: join(folder, `${mode}.png`) });
        const points = [calcQuad(0, step * 0.004, 1), calcLoad(0, step * 0.004, 1)];
        const [quad, load] = await readPixels(chromium.browser, png, points.map((point) => projectFlat(camera, point)));
        // From above the quadrotor hides the load.
        assert.ok(isColour(quad, kQuad), `${mode}: quadrotor: expected ${kQuad}, got ${quad}`);
        if (mode === "side") assert.ok(isColour(load, kLoad), `${mode}: load: expected ${kLoad}, got ${load}`);
      }
    });
  },

  async "buttons and keys ask the server, and replies are shown"() {
    await withPage({}, {}, async (page, server) => {
      await untilFlies(page);
      await page.click("[data-action=pause]");
      await waitFor("phase paused", async () => (await state(page)).phase === "paused");
      await page.click("[data-action=step]");
      await waitFor("reply to step", () => page.$eval("#reply", ({ textContent }) => /step done/.test(textContent)));
      await page.focus("#scene");
      await page.keyboard.press("Space");
      await waitFor("phase running", async () => (await state(page)).phase === "running");
      await page.click("[data-action=stop]");
      await page.click("#confirm-no");
      await page.click("[data-action=reset]");
      await page.click("#confirm-yes");
      await waitFor("reset", () => server.control.some(({ action }) => action === "reset"));
      const actions = server.control.filter(({ op }) => op === "control").map(({ action, steps }) => [action, steps]);
      assert.deepEqual(actions, [["pause", 0], ["step", 1], ["resume", 0], ["reset", 0]]);
    });
  },

  async "a connection that is lost is found again without reload, and the picture stays"() {
    const first = await startFakeServer({ page: html });
    const { port } = first;
    const { page, close } = await open(chromium.browser);
    try {
      await page.goto(first.url);
      await untilFlies(page);
      await page.evaluate(() => (window.isSamePage = true));
      await first.stop();
      await waitFor("banner", () => page.$eval("#banner", ({ hidden, textContent }) => !hidden && /lost/.test(textContent)));
      assert.equal(await page.$eval("[data-action=pause]", ({ disabled }) => disabled), true);
      assert.ok(await page.evaluate(() => window.slsView.projection(0)));
      await page.screenshot({ path: join(folder, "lost.png") });
      const second = await startFakeServer({ page: html, port });
      try {
        await waitFor("connection", async () => (await state(page)).is_connected);
        await waitFor("no banner", () => page.$eval("#banner", ({ hidden }) => hidden));
        assert.equal(await page.evaluate(() => window.isSamePage), true);
      } finally {
        await second.stop();
      }
    } finally {
      await close();
    }
  },

  async "a fleet of 100 is drawn, and a click chooses a vehicle"() {
    await withPage({ vehicles: 100 }, {}, async (page, server) => {
      await untilFlies(page);
      await page.click("[data-camera=top]");
      server.freeze(400);
      await waitFor("the frozen step", async () => (await state(page)).step === 400);
      const place = await page.evaluate(() => window.slsView.projection(42).quad);
      await page.mouse.click(...place);
      await waitFor("vehicle 42", async () => (await state(page)).selected === 42);
      await waitFor("select", () => server.control.some(({ op, vehicle_id }) => op === "select" && vehicle_id === 42));
      await page.screenshot({ path: join(folder, "fleet.png") });
    });
  },

  async "no flight: the page says what is missing, with the command"() {
    await withPage({ hasRun: false }, {}, async (page) => {
      await waitFor("command", () => page.$eval("#command", ({ textContent }) => textContent.startsWith("./sls run")));
      await page.screenshot({ path: join(folder, "no_flight.png") });
    });
  },

  async "no WebGL: a table of positions and the plots"() {
    const flat = await startBrowser({ flags: [...kLean, "--disable-3d-apis"] });
    const check = async (page) => {
      await untilFlies(page);
      assert.equal((await state(page)).has_scene, false);
      await waitFor("numbers in the table", () => page.$eval("#table tbody td:nth-child(2)", ({ textContent }) => /\d/.test(textContent)));
      await waitFor("a plot", () => page.$("#plots canvas"));
      await page.screenshot({ path: join(folder, "no_webgl.png") });
    };
    await withPage({ vehicles: 3 }, {}, check, { mayWarn: true, browser: flat.browser }).finally(flat.stop);
  },

  async "without the token there are no buttons; it leaves the address and never reaches the server over HTTP"() {
    const token = "a-token-of-the-test-0123";
    await withPage({ token }, {}, async (page, server) => {
      await waitFor("buttons", () => page.$("[data-action=pause]"));
      assert.equal(page.url(), server.url);
      assert.ok(server.requests.every((path) => !path.includes(token)));
    }, { hash: `#token=${token}` });
    await withPage({ token }, {}, async (page) => {
      await waitFor("reason", () => page.$eval("#bar", ({ textContent }) => /expected a token/.test(textContent)));
      assert.equal(await page.$("[data-action]"), null);
      await page.type("#bar input", token);
      await page.click("#bar button");
      await waitFor("buttons", () => page.$("[data-action=pause]"));
    });
    await withPage({ readOnly: true }, {}, async (page) => {
      await waitFor("reason", () => page.$eval("#bar", ({ textContent }) => /--read-only/.test(textContent)));
      assert.equal(await page.$("[data-action]"), null);
    });
  },

  async "a phone shows everything without scrolling sideways, and every control has a name"() {
    await withPage({}, { width: 390, height: 844, touch: true, scheme: "light" }, async (page) => {
      await untilFlies(page);
      assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= 390);
      const nameless = await page.$$eval("button, select, input, summary", (all) =>
        all.filter((item) => !(item.getAttribute("aria-label") || item.textContent.trim() || item.labels?.length)).length);
      assert.equal(nameless, 0);
      await page.screenshot({ path: join(folder, "phone.png") });
    });
  },
};

try {
  for (const [name, test] of Object.entries(tests)) {
    if (!name.includes(word)) continue;
    const began = performance.now();
    await test();
    console.log(`ok ${name} (${((performance.now() - began) / 1000).toFixed(1)} s)`);
  }
} finally {
  await chromium.stop();
}
