// The exported page, the served page and the report in Chromium: node --test replay_test.mjs, with the build folder
// in SLS_BUILD. closed_loop flies the flights; the tests compare positions on the screen with the CSV files.
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath, pathToFileURL } from "node:url";
import { kLean, open as openTab, readPixels, startBrowser } from "../page/browser.mjs";

const root = fileURLToPath(new URL("../../../..", import.meta.url));
const bin = join(process.env.SLS_BUILD ?? join(root, "build"), "bin");
const folder = mkdtempSync(join(tmpdir(), "sls-replay-"));
const kTimeout = 60_000;
let chromium;
let browser;

function fly(name, change = (text) => text, base = "faulty_figure_eight") {
  const scenario = join(folder, `${name}.yaml`);
  writeFileSync(scenario, change(readFileSync(join(root, `config/scenarios/${base}.yaml`), "utf8")));
  execFileSync(join(bin, "closed_loop"), ["--scenario", scenario, "--out", join(folder, name)], { stdio: "pipe" });
  return join(folder, name);
}

function exportPage(name, ...recordings) {
  const file = join(folder, name);
  execFileSync(join(bin, "sls_view"), [...recordings, "--export", file], { stdio: "pipe" });
  return file;
}

function readColumns(file) {
  const [header, ...lines] = readFileSync(file, "utf8").trimEnd().split("\n").map((line) => line.split(","));
  return lines.map((fields) => Object.fromEntries(header.map((name, index) => [name, Number(fields[index])])));
}

/** Opens a page; `problems` gets all its console messages and errors, and `requests` its network requests. */
async function open(address, { motion = "reduce" } = {}) {
  const { page, errors: problems, requests } = await openTab(browser, { width: 1280, height: 800, scheme: "light", motion });
  page.on("console", (message) => ["error", "warn"].includes(message.type()) || problems.push(message.text()));
  await page.goto(address, { timeout: kTimeout });
  return { page, problems, requests };
}

const waitFor = (page, condition, ...given) => page.waitForFunction(condition, { timeout: kTimeout }, ...given);
const stateOf = (page) => page.evaluate("window.slsView.state()");

/** Moves the slider as a user's drag does. */
const drag = (page, time) => page.$eval("#time", (slider, value) => {
  slider.value = value;
  slider.dispatchEvent(new Event("input"));
}, String(time));

/** Where a camera without perspective shows what is so many metres to the right of its target and above it. */
function toPixel({ area, height_m }, right, up) {
  const scale = area.height / height_m;
  return [area.left + area.width / 2 + right * scale, area.top + area.height / 2 - up * scale];
}

before(async () => {
  chromium = await startBrowser({ flags: kLean });
  browser = chromium.browser;
  fly("first");
  fly("second", (text) => text.replace("horizontal: 10", "horizontal: 3"));
});

after(async () => {
  await chromium?.stop();
  rmSync(folder, { recursive: true, force: true });
});

test("the slider shows the positions of the CSV file, and the load's colour is where they are", async () => {
  const { page, problems, requests } = await open(pathToFileURL(exportPage("one.html", join(folder, "first"))).href);
  await waitFor(page, () => window.slsView);
  assert.equal((await stateOf(page)).is_playing, false, "reduced motion starts paused");
  await page.click("[data-camera=top]");
  const rows = readColumns(join(folder, "first/state.csv"));
  for (const step of [0, 1250, 4000, 8000]) {
    const row = rows[step];
    await drag(page, row.sim_time_s);
    const pose = await page.evaluate("window.slsView.pose(0)");
    for (const [axis, name] of ["x", "y", "z"].entries()) {
      assert.ok(Math.abs(pose.quad[axis] - row[`quad_${name}_m`]) < 1e-6, `quad ${name} at step ${step}`);
      assert.ok(Math.abs(pose.load[axis] - row[`load_${name}_m`]) < 1e-6, `load ${name} at step ${step}`);
    }
    // From above: x up, y to the right.
    const { camera, projection } = await page.evaluate(() => ({
      camera: window.slsView.camera(), projection: window.slsView.projection(0) }));
    const expected = toPixel(camera, row.load_y_m - camera.target_m[1], row.load_x_m - camera.target_m[0]);
    assert.ok(Math.hypot(projection.load[0] - expected[0], projection.load[1] - expected[1]) < 1.5, `step ${step}`);
  }
  await page.setViewport({ width: 960, height: 600 }); // the buttons cover a fifth of it
  for (const mode of ["top", "side"]) {
    await page.click(`[data-camera=${mode}]`);
    await page.click("#fit");
    const camera = await page.evaluate("window.slsView.camera()");
    const buttons = await page.$eval(".scene-tools", (tools) => tools.getBoundingClientRect().bottom);
    const [tx, ty, tz] = camera.target_m;
    for (const { step, quad_x_m: x, quad_y_m: y, quad_z_m: z } of rows) {
      const [across, down] = mode === "top" ? toPixel(camera, y - ty, x - tx) : toPixel(camera, x - tx, tz - z);
      assert.ok(across > 0 && across < camera.area.width && down > buttons && down < camera.area.top + camera.area.height,
                `${mode}: the vehicle of step ${step} is at ${[across, down]}, outside or behind the buttons`);
    }
  }
  await page.click("[data-camera=follow]");
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  const { load } = await page.evaluate("window.slsView.projection(0)");
  const [[red, green, blue]] = await readPixels(browser, await page.screenshot(), [load]);
  assert.ok(red > 150 && green > 70 && green < 200 && blue < 120, `the load is orange, got ${red}, ${green}, ${blue}`);
  assert.deepEqual(problems, []);
  assert.deepEqual(requests.filter((address) => !/^(file|data):/.test(address)), []);
  await page.close();
});

test("one load is drawn at its centre, and its cables are taut, hang slack or are gone", async () => {
  const openFlight = async (name, base, change) => {
    fly(name, change, base);
    const { page, problems } = await open(pathToFileURL(exportPage(`${name}.html`, join(folder, name))).href);
    await waitFor(page, () => window.slsView);
    return { page, problems, rows: readColumns(join(folder, name, "state.csv")) };
  };
  const show = async (page, camera, time) => {
    await page.click(`[data-camera=${camera}]`);
    await page.evaluate((at) => window.slsView.seek(at), time);
    await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
    return page.evaluate(() => [window.slsView.camera(), window.slsView.cable(0)]);
  };
  const isNear = (a, b, most) => a.every((value, index) => Math.abs(value - b[index]) <= most);

  // A load that falls 0.3 m below the lower end of a cable of 1 m, whose ends are 0.4 m apart and above each other.
  const drop = await openFlight("drop", "slack_drop", (text) => text.replace("for_s: 10", "for_s: 1"));
  let row = drop.rows[5];
  let [camera, points] = await show(drop.page, "side", row.sim_time_s);
  const fold = row.load_z_m + (1 - (row.load_z_m - row.quad_z_m)) / 2;
  assert.ok(Math.abs(Math.max(...points.map(([, , z]) => z)) - fold) < 2e-3, `${fold}: ${points}`);
  const [x, y] = toPixel(camera, row.load_x_m - camera.target_m[0], camera.target_m[2] - fold + 0.1);
  const colours = await readPixels(browser, await drop.page.screenshot(), [-1, 0, 1].map((off) => [x + off, y]));
  assert.ok(colours.some((colour) => isNear(colour, [153, 161, 171], 8)), `a slack cable, got ${colours.join("  ")}`);
  [, points] = await show(drop.page, "side", 0.9);
  assert.equal(points.length, 2, "taut");
  assert.deepEqual(drop.problems, []);
  await drop.page.close();

  const cut = await openFlight("cut", "cable_cut", (text) =>
    text.replace("release_s: 8", "release_s: 1").replace("for_s: 22", "for_s: 1"));
  assert.equal((await show(cut.page, "top", 0.9))[1].length, 2);
  [camera, points] = await show(cut.page, "top", 2);
  assert.equal(points.length, 0, "cut");
  row = cut.rows.find((candidate) => candidate.vehicle_id === 0 && Math.abs(candidate.sim_time_s - 2) < 1e-9);
  // The centre from the corner: p − R ρ, by the rotation matrix of the attitude.
  const [w, a, b, c] = ["w", "x", "y", "z"].map((axis) => row[`load_att_${axis}`]);
  const corner = [0.3048, 0.2286, -0.01125];
  const dot = (line) => line.reduce((sum, value, index) => sum + value * corner[index], 0);
  const centre = [row.load_x_m - dot([1 - 2 * (b * b + c * c), 2 * (a * b - w * c), 2 * (a * c + w * b)]),
    row.load_y_m - dot([2 * (a * b + w * c), 1 - 2 * (a * a + c * c), 2 * (b * c - w * a)])];
  const pixel = toPixel(camera, centre[1] - camera.target_m[1], centre[0] - camera.target_m[0]);
  // Below a rotor, whose disc is faint; a blade may cross some of these places.
  const places = [-3, 0, 3].map((off) => pixel.map((at) => at + off));
  const seen = await readPixels(browser, await cut.page.screenshot(), places);
  assert.ok(seen.some((colour) => isNear(colour, [0xe0, 0x86, 0x00], 30)), `the load at its centre, got ${seen.join("  ")}`);
  assert.deepEqual(cut.problems, []);
  await cut.page.close();
});

test("it plays by itself, at the chosen speed, and by keys", async () => {
  const { page, problems } = await open(pathToFileURL(join(folder, "one.html")).href, { motion: "no-preference" });
  await waitFor(page, () => window.slsView?.state().sim_time_s > 0.2);
  await page.keyboard.press(" ");
  const paused = await stateOf(page);
  assert.equal(paused.is_playing, false);
  await page.keyboard.press(".");
  assert.ok(Math.abs((await stateOf(page)).sim_time_s - paused.sim_time_s - 0.004) < 1e-9);
  await page.focus("#time");
  await page.keyboard.press("ArrowLeft");
  assert.ok(Math.abs((await stateOf(page)).sim_time_s - paused.sim_time_s) < 1e-9);
  await page.keyboard.press("End");
  await drag(page, 31.9);
  await page.select(".timeline-controls select", "10");
  await page.keyboard.press("l");
  await page.click(".timeline-play");
  await waitFor(page, () => window.slsView.state().sim_time_s < 20); // the flight began again
  assert.equal((await stateOf(page)).is_playing, true);
  assert.deepEqual(problems, []);
  await page.close();
});

test("stages, events and faults are marks, and a click goes there", async () => {
  const { page } = await open(pathToFileURL(join(folder, "one.html")).href);
  await waitFor(page, () => window.slsView);
  const texts = await page.$$eval("#events li", (items) => items.map((item) => item.textContent));
  for (const text of ["fault: freeze on state", "fault: bias on command", "stage figure_eight", "finished"])
    assert.ok(texts.some((item) => item.includes(text)), `${text} in ${texts}`);
  assert.equal((await page.$$(".timeline-band .timeline-fault")).length, 7);
  await page.$$eval("#events button", (buttons) =>
    buttons.find((button) => button.textContent.includes("freeze on state")).click());
  assert.equal((await stateOf(page)).sim_time_s, 10);
  const slider = await page.$eval("#time", ({ ariaValueText, value }) => ({ ariaValueText, value }));
  assert.deepEqual(slider, { ariaValueText: "10.00 / 32.00 s, figure_eight", value: "10" });
  await page.close();
});

test("two recordings are overlaid and their difference is that of the CSV files", async () => {
  const file = exportPage("two.html", join(folder, "first"), join(folder, "second"));
  const { page, problems } = await open(pathToFileURL(file).href);
  await waitFor(page, () => window.slsView);
  assert.deepEqual((await stateOf(page)).recordings, ["first", "second"]);
  const [first, second] = ["first", "second"].map((name) => readColumns(join(folder, name, "state.csv")));
  const apart = first.map((row, step) => Math.hypot(
    ...["x", "y", "z"].map((axis) => row[`load_${axis}_m`] - second[step][`load_${axis}_m`])));
  const most = await page.$eval("#most-apart", ({ textContent }) => textContent);
  // The page has some thousand of the steps and prints three digits.
  assert.ok(Math.abs(parseFloat(most) / Math.max(...apart) - 1) < 0.02, `${most}, ${Math.max(...apart)}`);
  await drag(page, first[3600].sim_time_s);
  const texts = await page.$$eval("#participants dd", (items) => items.map(({ textContent }) => textContent));
  assert.ok(texts.some((text) => Math.abs(parseFloat(text) / apart[3600] - 1) < 0.01), `${texts}, ${apart[3600]}`);
  assert.deepEqual(problems, []);
  await page.close();
});

test("sls_view serves two recordings, and says what is wrong with a folder that holds none", async (context) => {
  assert.throws(() => execFileSync(join(bin, "sls_view"), [folder], { stdio: "pipe", timeout: kTimeout }),
    ({ status, stderr }) => status === 2 && /expected a recording/.test(stderr));
  const server = spawn(join(bin, "sls_view"), [join(folder, "first"), join(folder, "second"), "--port", "0"]);
  context.after(() => server.kill("SIGTERM"));
  const address = await new Promise((found, failed) => {
    let text = "";
    server.stderr.on("data", (data) => {
      text += data;
      const place = /http:\/\/[0-9.:]+\//.exec(text);
      if (place) found(place[0]);
    });
    server.on("exit", () => failed(new Error(text)));
  });
  const { page, problems, requests } = await open(address);
  await waitFor(page, () => window.slsView);
  assert.deepEqual((await stateOf(page)).recordings, ["first", "second"]);
  assert.ok(requests.every((request) => request.startsWith(address) || request.startsWith("data:")), `${requests}`);
  assert.deepEqual(problems, []);
  await page.close();
});

test("a flight of one step has no axes, and names and legends stay whole at the width of a report", async () => {
  const short = fly("one-step", (text) => text.replace(/for_s: .*/, "for_s: 0.004"));
  for (const file of ["state.csv", "command.csv", "reference.csv"])
    writeFileSync(join(short, file), readFileSync(join(short, file), "utf8").split("\n").slice(0, 2).join("\n") + "\n");
  const { page } = await open(pathToFileURL(exportPage("one-step.html", short)).href);
  await waitFor(page, () => document.querySelector(".plot-body.empty"));
  assert.equal(await page.$("#plots canvas"), null);
  await page.goto(pathToFileURL(exportPage("report-width.html", join(folder, "first"))).href);
  await page.setViewport({ width: 1030, height: 680 });
  await waitFor(page, () => document.querySelector("#plots canvas"));
  const rows = (selector) => page.$$eval(selector, (all) =>
    Math.max(...all.map((one) => new Set([...one.children].map((child) => child.getBoundingClientRect().top)).size)));
  assert.equal(await rows(".plot[open] .legend"), 1);
  // A word is not broken: the text of an event needs no more lines than it has words.
  const broken = await page.$$eval("#events button", (all) => all.filter((one) => {
    const range = document.createRange();
    range.selectNodeContents(one.lastChild);
    return new Set([...range.getClientRects()].map((box) => box.top)).size > one.lastChild.textContent.split(" ").length;
  }).length);
  assert.equal(broken, 0);
  await page.close();
});

test("a damaged recording in the page is named on it", async () => {
  const html = readFileSync(join(folder, "one.html"), "utf8");
  const begin = html.indexOf(">", html.indexOf('id="sls-recording-0"')) + 1;
  const end = html.indexOf("</script>", begin);
  const cases = {
    "expected base64": "?",
    "expected a recording, got 0 bytes": "",
    "expected the first bytes SLSVIEW1": "A".repeat(400),
    "bytes of vehicle 0": html.slice(begin, begin + 400_000),
  };
  for (const [text, data] of Object.entries(cases)) {
    const file = join(folder, "damaged.html");
    writeFileSync(file, html.slice(0, begin) + data + html.slice(end));
    const { page } = await open(pathToFileURL(file).href);
    await waitFor(page, () => !document.getElementById("banner").hidden);
    const banner = await page.$eval("#banner", ({ textContent }) => textContent);
    assert.ok(banner.includes(text), `${text} in ${banner}`);
    await page.close();
  }
});

test("the report shows the scene, needs nothing else and has at most 4 MB", async () => {
  const recording = join(folder, "first");
  execFileSync("/usr/bin/python3", ["-B", "-m", "sls", "report", recording], {
    stdio: "pipe",
    env: { ...process.env, SLS_VIEW: join(bin, "sls_view"), PYTHONPATH: `${join(root, "python")}:${join(bin, "../python")}` },
  });
  const file = join(recording, "report.html");
  assert.ok(readFileSync(file).length <= 4_000_000);
  const { page, problems, requests } = await open(pathToFileURL(file).href);
  const element = await page.waitForSelector("iframe.scene", { timeout: kTimeout });
  await element.scrollIntoView();
  const frame = await element.contentFrame();
  await waitFor(frame, () => window.slsView?.frames() > 0);
  const state = await stateOf(frame);
  assert.equal(state.has_scene, true);
  assert.equal(state.is_playing, false, "a report does not move by itself");
  assert.deepEqual(await page.evaluate(() => {
    const { scrollWidth, clientWidth } = document.documentElement;
    return { broken: [...document.images].filter((image) => !image.naturalWidth).length, overflow: scrollWidth - clientWidth };
  }), { broken: 0, overflow: 0 });
  await frame.evaluate("window.slsView.seek(5)");
  const row = readColumns(join(recording, "state.csv"))[1250];
  const pose = await frame.evaluate("window.slsView.pose(0)");
  assert.ok(Math.abs(pose.load[0] - row.load_x_m) < 1e-4 && Math.abs(pose.load[2] - row.load_z_m) < 1e-4);
  assert.deepEqual(problems, []);
  assert.deepEqual(requests.filter((address) => !/^(file|about|data):/.test(address)), []);
  await page.close();
});
