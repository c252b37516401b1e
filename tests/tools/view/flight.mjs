// A flight of the real programs in real time, on a DDS domain of its own, and viewers of it.
import { spawn, spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { waitFor } from "./page/browser.mjs";

export const root = fileURLToPath(new URL("../../..", import.meta.url));
const bin = join(process.env.SLS_BUILD ?? join(root, "build"), "bin");
const kHoldDomain = "import sys\nsys.path.append('../../python')\nimport own_domain\n" +
  "with own_domain.own_domain() as domain:\n    print(domain, flush=True)\n    sys.stdin.read()";

/**
 * Flies the shipped scenario `base` with `change`. `hasFlight` false: only reserves the domain.
 * Returns { folder, startViewer, status, stop }.
 */
export async function startFlight({ base = "figure_eight", change = (text) => text, rtf = 1, hasFlight = true } = {}) {
  const folder = mkdtempSync(join(tmpdir(), "sls-view-flight-"));
  const programs = [];
  const start = (program, args, cwd) => {
    const child = spawn(program, args, { cwd, stdio: ["pipe", "pipe", "pipe"] });
    const started = { child, log: "" };
    for (const stream of [child.stdout, child.stderr]) stream.on("data", (data) => (started.log += data));
    programs.push(started);
    return started;
  };
  const end = async ({ child }) => {
    if (child.exitCode !== null || child.signalCode !== null) return;
    const ended = new Promise((resolve) => child.once("exit", resolve));
    child.kill("SIGINT");
    const timer = setTimeout(() => child.kill("SIGKILL"), 20_000);
    await ended;
    clearTimeout(timer);
  };
  const holder = start("/usr/bin/python3", ["-B", "-c", kHoldDomain], join(root, "tests/support"));
  const domain = (await waitFor("a domain", () => /^\d+\n/.exec(holder.log)?.[0])).trim();
  const onDomain = (name, ...args) => start(join(bin, name), ["--domain", domain, ...args]);

  if (hasFlight) {
    const file = join(folder, "scenario.yaml");
    const text = change(readFileSync(join(root, `config/scenarios/${base}.yaml`), "utf8"));
    // Longer than any test, also on a slow machine; the recording is soon on the disk.
    writeFileSync(file, text.replace(/for_s: \d+/, "for_s: 3600").replace("mission:", "record: { flush_s: 0.02 }\nmission:"));
    onDomain("sim_server", "--scenario", file, "--mode", "realtime", "--rtf", String(rtf));
    onDomain("control_client", "--scenario", file);
    onDomain("recorder", "--out", join(folder, "recording"));
  }
  return {
    folder,
    /** Starts sls_view: { url, port, stop }. */
    async startViewer(...flags) {
      const viewer = onDomain("sls_view", ...(flags.includes("--port") ? [] : ["--port", "0"]), ...flags);
      const url = await waitFor("address of sls_view", () => /page: (http:\S+)/.exec(viewer.log)?.[1]);
      return { url, port: new URL(url).port, stop: () => end(viewer) };
    },
    /** The run's status from sim_ctl, independent of the page. */
    status() {
      const result = spawnSync(join(bin, "sim_ctl"), ["--domain", domain, "--timeout-s", "20", "status", "--json"], { encoding: "utf8" });
      if (result.status !== 0) throw new Error(`sim_ctl: ${result.stderr}`);
      return JSON.parse(result.stdout);
    },
    async stop() {
      // The first one holds the domain of the others.
      for (const program of [...programs].reverse()) await end(program);
      rmSync(folder, { recursive: true, force: true });
    },
  };
}
