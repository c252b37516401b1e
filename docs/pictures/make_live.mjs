// Makes docs/pictures/live.png, a flight on its page: flies figure_eight with `./sls run --view`, pauses it on the
// second lap by the button of the page, and takes the picture in headless Chromium.
//
//     npm ci --prefix tests/tools/view && node docs/pictures/make_live.mjs [DOMAIN]
import { spawn } from "node:child_process";
import { mkdtempSync, rmSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { startBrowser, waitFor } from "../../tests/tools/view/page/browser.mjs";

const root = join(dirname(fileURLToPath(import.meta.url)), "../..");
const picture = join(root, "docs/pictures/live.png");
const domain = process.argv[2] ?? "0";
const kPauseTime = 17; // s of simulated time: on the second lap
const kMostBytes = 300_000;

const folder = mkdtempSync(join(tmpdir(), "sls-picture-"));
const flight = spawn(join(root, "sls"), ["run", "figure_eight", "--mode", "realtime", "--rtf", "0.5", "--view-port", "0",
                                         "--domain", domain, "--out", join(folder, "recording")],
                     { stdio: ["ignore", "inherit", "pipe"] });
let log = "";
flight.stderr.on("data", (data) => (log += data));
const ended = new Promise((resolve) => flight.once("exit", resolve));
const chromium = await startBrowser({ width: 1280, height: 720, scheme: "light" });
const { page } = chromium;
try {
  const url = await waitFor("the address of the page", () => /page: (http:\S+)/.exec(log)?.[1], 600_000);
  await page.goto(url);
  const state = () => page.evaluate(() => window.slsView.state());
  await waitFor("the second lap", async () => ((await state()).sim_time_s ?? 0) > kPauseTime, 90_000);
  await page.click("[data-action=pause]");
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
} catch (error) {
  process.stderr.write(log);
  throw error;
} finally {
  await chromium.stop();
  if (flight.exitCode === null) flight.kill("SIGTERM");
  await ended;
  rmSync(folder, { recursive: true, force: true });
}
const bytes = statSync(picture).size;
if (bytes > kMostBytes) throw new Error(`${picture}: expected at most ${kMostBytes} bytes, got ${bytes}`);
console.log(`${picture}: ${bytes} bytes`);
