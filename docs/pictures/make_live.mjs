// Makes docs/pictures/live.png, a flight on its page: flies figure_eight, pauses it on the second lap by the button of
// the page, and takes the picture in headless Chromium.
//
//     ./sls build && npm ci --prefix tests/tools/view && node docs/pictures/make_live.mjs
import { fileURLToPath } from "node:url";
import { startFlight } from "../../tests/tools/view/flight.mjs";
import { open, startBrowser, waitFor } from "../../tests/tools/view/page/browser.mjs";

const picture = fileURLToPath(new URL("live.png", import.meta.url));
const kPauseTime = 17; // s of simulated time: on the second lap

const flight = await startFlight({ rtf: 0.5 });
const chromium = await startBrowser();
try {
  const { url } = await flight.startViewer("--recording", `${flight.folder}/recording`);
  const { page } = await open(chromium.browser, { width: 1280, height: 720, scheme: "light" });
  await page.goto(url);
  const state = () => page.evaluate(() => window.slsView.state());
  await waitFor("the second lap", async () => ((await state()).sim_time_s ?? 0) > kPauseTime, 90_000);
  await page.$eval("[data-action=pause]", (button) => button.click());
  await waitFor("the pause", async () => (await state()).phase === "paused");
  await page.click("#fit");
  await page.focus("#scene");
  for (let i = 0; i < 2; ++i) await page.keyboard.press("+");
  let last = -1; // frame: none is drawn once nothing changes
  await waitFor("the last frame", async () => {
    const frames = await page.evaluate(() => window.slsView.frames());
    const isLast = frames === last;
    last = frames;
    return isLast;
  });
  await page.evaluate(() => document.activeElement.blur());
  await page.screenshot({ path: picture });
} finally {
  await chromium.stop();
  await flight.stop();
}
