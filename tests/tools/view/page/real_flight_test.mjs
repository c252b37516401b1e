// The page with a flight of the real programs: node real_flight_test.mjs BUILD FOLDER [DOMAIN]
import assert from "node:assert/strict";
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { kLean, open, readPixels, startBrowser, waitFor } from "./browser.mjs";
import { startFlight } from "./flight.mjs";

const [build, folder, domain = "140"] = process.argv.slice(2);
mkdirSync(folder, { recursive: true });
const kColours = { quad: [0x1f, 0x84, 0xd6], load: [0xe0, 0x86, 0x00] };
const kTolerance = 6;
const kPlaces = [[0, 0], [-3, -2], [3, -2], [-3, 2], [3, 2]];

const flight = await startFlight({ build, domain });
const { browser, stop } = await startBrowser({ flags: kLean });
const { page, errors, requests } = await open(browser);
const state = () => page.evaluate(() => window.slsView.state());
/** Clicks as a user does: on a button that can be pressed. Waits for the reply, which must say that the request was carried out. */
const press = async (action) => {
  await waitFor(`${action} can be pressed`, () => page.$eval(`[data-action=${action}]`, ({ disabled, hidden }) => !disabled && !hidden));
  await page.click(`[data-action=${action}]`);
  const reply = await waitFor(`reply to ${action}`, () =>
    page.$eval("#reply", ({ textContent }, word) => new RegExp(`^${word} (done|refused|not)`).test(textContent) && textContent, action));
  assert.match(reply, /^\w+ done at step \d+$/);
};
try {
  await page.goto(flight.url);
  await waitFor("a flight on the page", async () => (await state()).step > 250, 60_000);

  await press("pause");
  await waitFor("sim_ctl: paused", () => flight.status().phase === "paused");
  await waitFor("page: paused", async () => (await state()).phase === "paused");
  console.log("ok the pause button holds the real run");

  const stepOn = async (count) => {
    const before = flight.status().step;
    await page.$eval("#bar input[type=number]", (field, value) => (field.value = value), String(count));
    await press("step");
    await waitFor(`${count} steps`, () => flight.status().step === before + count);
    return before + count;
  };
  let last = await stepOn(7);
  console.log("ok the step button lets it go seven steps");

  await page.click("[data-camera=side]");
  await page.click("#fit");
  /** The part whose colour a picture of step `last` does not show where it is; nothing if it shows both. */
  const findMissing = async () => {
    await waitFor("the paused step", async () => (await state()).step >= last - 1);
    const frames = await page.evaluate(() => window.slsView.frames());
    await page.evaluate(() => window.slsView.redraw());
    await waitFor("a frame of it", async () => (await page.evaluate(() => window.slsView.frames())) > frames);
    const [camera, pose] = await page.evaluate(() => [window.slsView.camera(), window.slsView.pose(0)]);
    const png = await page.screenshot({ path: join(folder, "real_side.png") });
    const scale = camera.area.height / camera.height_m;
    for (const part of ["quad", "load"]) {
      const pixel = [
        camera.area.left + camera.area.width / 2 + (pose[part][0] - camera.target_m[0]) * scale,
        camera.area.top + camera.area.height / 2 + (pose[part][2] - camera.target_m[2]) * scale,
      ];
      // A line of the path or the trail may cross the body, but not most of these places on it.
      const places = kPlaces.map(([x, y]) => [pixel[0] + x, pixel[1] + y]);
      const colours = await readPixels(browser, png, places);
      const right = colours.filter((colour) => colour.every((value, index) => Math.abs(value - kColours[part][index]) <= kTolerance));
      if (right.length < 3) return `${part} at ${pixel}: expected ${kColours[part]}, got ${colours.join("  ")}`;
    }
    return null;
  };
  // Where path, trail and reference cross, lines cover most of a body: then a later step shows it.
  let missing = await findMissing();
  if (missing) {
    last = await stepOn(100);
    missing = await findMissing();
  }
  assert.equal(missing, null);
  console.log("ok pixels of the real flight have the colours of quadrotor and load");

  await press("resume");
  await waitFor("sim_ctl: running", () => flight.status().phase === "running");
  console.log("ok the resume button lets it go on");

  await page.click("[data-camera=free]");
  await flight.endViewer();
  await waitFor("banner", () => page.$eval("#banner", ({ hidden }) => !hidden));
  await flight.restartViewer();
  const step = (await state()).step;
  await waitFor("later steps", async () => (await state()).is_connected && (await state()).step > step);
  await page.screenshot({ path: join(folder, "real.png") });
  console.log("ok the page finds a viewer that was started again");

  const unexpected = errors.filter((text) => !/WebSocket|ERR_CONNECTION/.test(text));
  assert.deepEqual(unexpected, []);
  for (const url of requests) assert.ok(url.startsWith(flight.url) || url.startsWith("data:"), `foreign request: ${url}`);
  console.log("ok no error in the console, no request to another server");
} finally {
  await stop();
  await flight.stop();
}
