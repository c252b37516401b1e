// A flight of the real programs in real time, with sls_view.
import { spawn, spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { waitFor } from "./browser.mjs";

const source = join(dirname(fileURLToPath(import.meta.url)), "../../../..");

/** `build`: the build tree. Returns { url, status, stop, … }. */
export async function startFlight({ build, domain }) {
  const folder = mkdtempSync(join(tmpdir(), "sls-view-flight-"));
  const file = join(folder, "scenario.yaml");
  const text = readFileSync(join(source, "config/scenarios/figure_eight.yaml"), "utf8");
  writeFileSync(file, text.replace("for_s: 32", "for_s: 3600")); // longer than any test, also on a slow machine
  const programs = [];
  const start = (name, ...args) => {
    const child = spawn(join(build, "bin", name), ["--domain", String(domain), ...args], { stdio: ["ignore", "ignore", "pipe"] });
    const program = { name, child, log: "" };
    child.stderr.on("data", (data) => (program.log += data));
    programs.push(program);
    return program;
  };
  const end = async (program) => {
    if (program.child.exitCode !== null || program.child.signalCode !== null) return;
    const ended = new Promise((resolve) => program.child.once("exit", resolve));
    program.child.kill("SIGINT");
    const timer = setTimeout(() => program.child.kill("SIGKILL"), 15_000);
    await ended;
    clearTimeout(timer);
  };
  const startViewer = async (wanted) => {
    const viewer = start("sls_view", "--port", String(wanted));
    const url = await waitFor("address of sls_view", () => /page: (http:\S+)/.exec(viewer.log)?.[1]);
    return { viewer, url };
  };
  let { viewer, url } = await startViewer(0);
  start("sim_server", "--scenario", file, "--mode", "realtime", "--rtf", "1");
  start("control_client", "--scenario", file);
  start("recorder", "--out", join(folder, "recording"));
  return {
    url,
    /** The run's status from sim_ctl, independent of the page. */
    status() {
      const result = spawnSync(join(build, "bin/sim_ctl"), ["--domain", String(domain), "status", "--json"], { encoding: "utf8" });
      if (result.status !== 0) throw new Error(`sim_ctl: ${result.stderr}`);
      return JSON.parse(result.stdout);
    },
    async endViewer() {
      await end(viewer);
    },
    async restartViewer() {
      ({ viewer, url } = await startViewer(new URL(url).port));
    },
    async stop() {
      await Promise.all([...programs].reverse().map(end));
      rmSync(folder, { recursive: true, force: true });
    },
  };
}
