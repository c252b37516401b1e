// Figures of the page, one JSON line: node measure.mjs load|latency|fleet BUILD [DOMAIN [SECONDS]]
import { statSync } from "node:fs";
import { join } from "node:path";
import { kLean, open, startBrowser, waitFor } from "./browser.mjs";
import { startFakeServer } from "./fake_server.mjs";
import { startFlight } from "./flight.mjs";

const [what, build, domain = "141", seconds = "10"] = process.argv.slice(2);
const kMeasuredMs = Number(seconds) * 1000;
const kFlags = kMeasuredMs > 1000 ? [] : kLean; // a second only shows that it works
const page_file = join(build, "tools/view/page/page.html");

/** Time from the request until the page has drawn for the first time. */
async function measureLoad() {
  const flight = await startFlight({ build, domain });
  const { browser, stop } = await startBrowser({ flags: kFlags });
  const { page } = await open(browser);
  try {
    const began = performance.now();
    await page.goto(flight.url, { waitUntil: "load" });
    await waitFor("first frame", () => page.evaluate(() => (window.slsView?.frames() ?? 0) > 0));
    const first_frame_ms = performance.now() - began;
    const load_ms = await page.evaluate(() => performance.getEntriesByType("navigation")[0].loadEventEnd);
    return { load_ms, first_frame_ms, bytes: statSync(page_file).size, gzip_bytes: statSync(`${page_file}.gz`).size };
  } finally {
    await stop();
    await flight.stop();
  }
}

/** A flight of 250 Hz in real time; latencies of the last 1,000 frames. */
async function measureLatency() {
  const flight = await startFlight({ build, domain });
  const { browser, stop } = await startBrowser({ flags: kFlags });
  const { page } = await open(browser);
  try {
    await page.goto(flight.url);
    await waitFor("flight", () => page.evaluate(() => (window.slsView?.state().step ?? 0) > 250), 60_000);
    await page.evaluate(() => window.slsView.resetLatency());
    await new Promise((resolve) => setTimeout(resolve, kMeasuredMs));
    // On a busy machine the first frame may need longer than the measurement.
    await waitFor("measured frame", () => page.evaluate(() => window.slsView.latency().count > 0));
    const { p50, p99, count } = await page.evaluate(() => window.slsView.latency());
    return { p50_ms: p50, p99_ms: p99, frames: count };
  } finally {
    await stop();
    await flight.stop();
  }
}

/** Frames a second that Chromium draws in software, with 100 vehicles that fly by closed forms. */
async function measureFleet() {
  const server = await startFakeServer({ page: page_file, vehicles: 100 });
  const { browser, stop } = await startBrowser({ flags: kFlags });
  const { page } = await open(browser);
  try {
    await page.goto(server.url);
    await waitFor("flight", () => page.evaluate(() => (window.slsView?.state().step ?? 0) > 250));
    await new Promise((resolve) => setTimeout(resolve, Math.min(3000, kMeasuredMs))); // the page adapts its resolution
    const begin = await page.evaluate(() => [window.slsView.frames(), performance.now()]);
    await new Promise((resolve) => setTimeout(resolve, kMeasuredMs));
    const end = await page.evaluate(() => [window.slsView.frames(), performance.now(), window.slsView.camera().resolution]);
    return { frames_per_s: ((end[0] - begin[0]) * 1000) / (end[1] - begin[1]), resolution: end[2] };
  } finally {
    await stop();
    await server.stop();
  }
}

const measures = { load: measureLoad, latency: measureLatency, fleet: measureFleet };
if (!measures[what] || !build) {
  console.error("usage: node measure.mjs load|latency|fleet BUILD [DOMAIN [SECONDS]]");
  process.exit(2);
}
console.log(JSON.stringify(await measures[what]()));
