// A headless Chromium with its own profile folder, and functions for tests of a page.
import { existsSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import puppeteer from "puppeteer-core";

const kChromium = process.env.SLS_CHROMIUM ??
  process.env.PATH.split(":").flatMap((folder) => ["chromium", "google-chrome"].map((name) => join(folder, name))).find(existsSync);

/** Flags of a browser whose speed is not measured: fewer processes, and only the scene is drawn by the software GPU. */
export const kLean = ["--disable-gpu-compositing", "--in-process-gpu", "--disable-extensions",
                      "--disable-features=SpareRendererForSitePerProcess,Translate,MediaRouter,OptimizationHints"];

/** A browser without a tab. */
export async function startBrowser({ flags = [] } = {}) {
  if (!kChromium) throw new Error("skipped: no Chromium (apt-get install chromium)"); // ctest looks for this text
  const folder = mkdtempSync(join(tmpdir(), "sls-view-chromium-"));
  const launch = () => puppeteer.launch({
    executablePath: kChromium,
    headless: true,
    userDataDir: folder,
    protocolTimeout: 120_000,
    args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run",
           "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage",
           ...flags],
  });
  // Chromium itself crashed once within 0.2 s of its start, and in none of 30 others: it may try twice.
  const browser = await launch().catch((error) => {
    console.error(error.message);
    return launch();
  });
  return {
    browser,
    async stop() {
      await browser.close();
      rmSync(folder, { recursive: true, force: true, maxRetries: 5 });
    },
  };
}

/** A tab that shares nothing with the others; `errors` and `requests` grow. The fragment of an address is never sent. */
export async function open(browser, { width = 960, height = 600, scheme = "dark", touch = false, motion = "no-preference" } = {}) {
  const context = await browser.createBrowserContext();
  const page = await context.newPage();
  await page.setViewport({ width, height, hasTouch: touch, isMobile: touch, deviceScaleFactor: 1 });
  await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }, { name: "prefers-reduced-motion", value: motion }]);
  const errors = [];
  const requests = [];
  // Chromium warns of its own reading, where the GPU does not draw the page.
  page.on("console", (message) => ["error", "warn"].includes(message.type()) && !/ReadPixels/.test(message.text()) &&
    errors.push(message.text()));
  page.on("pageerror", (error) => errors.push(String(error)));
  page.on("request", (request) => requests.push(request.url().split("#")[0]));
  const session = await page.createCDPSession();
  await session.send("Network.enable");
  session.on("Network.webSocketCreated", ({ url }) => requests.push(url));
  return { page, errors, requests, close: () => context.close() };
}

/** Waits until `check` returns a true value; an element that is not there is none.
 *  @throws Error after `limit` ms, with the last value. */
export async function waitFor(what, check, limit = 60_000) {
  const end = performance.now() + limit;
  let last;
  for (;;) {
    try {
      last = await check();
      if (last) return last;
    } catch (error) {
      if (!/failed to find element/.test(error.message)) throw error;
      last = error.message; // it may still come
    }
    if (performance.now() > end) throw new Error(`${what}: not within ${limit} ms; last: ${JSON.stringify(last)}`);
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}

/** Red, green and blue of pixels of a screenshot, decoded by Chromium itself: [[x, y], …] → [[r, g, b], …]. */
export async function readPixels(browser, png, places) {
  const page = await browser.newPage();
  try {
    return await page.evaluate(async (data, wanted) => {
      const image = new Image();
      image.src = data;
      await image.decode();
      const canvas = document.createElement("canvas");
      [canvas.width, canvas.height] = [image.width, image.height];
      const context = canvas.getContext("2d");
      context.drawImage(image, 0, 0);
      return wanted.map(([x, y]) => [...context.getImageData(Math.round(x), Math.round(y), 1, 1).data.slice(0, 3)]);
    }, `data:image/png;base64,${Buffer.from(png).toString("base64")}`, places);
  } finally {
    await page.close();
  }
}
