// Pauses, steps and resumes a real flight with the services, as an operator in Foxglove does.
import assert from "node:assert/strict";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { test } from "node:test";
import { Client, makeReader, Program, root, startPublisher, startView, waitFor } from "./support.mjs";

const kPaused = 2, kRunning = 1; // RunPhase
const kScenario = path.join(root, "config/scenarios/figure_eight.yaml");
const kQos = path.join(root, "config/qos/udp.xml");

async function startFlight(t, domain) {
  const folder = mkdtempSync(path.join(tmpdir(), "sls-foxglove-"));
  t.after(() => rmSync(folder, { recursive: true, force: true }));
  const common = ["--qos", kQos, "--domain", String(domain)];
  return [
    new Program(t, "bin/sim_server", ["--scenario", kScenario, "--mode", "realtime", ...common]),
    new Program(t, "bin/control_client", ["--scenario", kScenario, ...common]),
    new Program(t, "bin/recorder", ["--out", folder, ...common]),
  ];
}

/** Waits until the last status has the phase `wanted`; returns that status. */
async function phase(client, wanted) {
  const read = makeReader(client.channels.get("sls/status"));
  return await waitFor(`phase ${wanted}`, () => {
    const last = client.messages.get("sls/status")?.at(-1);
    const status = last && read(last.data);
    return status?.phase === wanted ? status : undefined;
  });
}

test("an operator pauses, steps and resumes a flight", async (t) => {
  const { domain } = await startPublisher(t, "hold");
  const view = await startView(t, domain);
  const client = new Client(t, view.url);
  await startFlight(t, domain);
  await client.subscribe("sls/status");
  await client.subscribe("sls/state");
  await phase(client, kRunning);
  assert.ok(client.serverInfos.at(-1).capabilities.includes("services"));

  const paused = await client.call("/sls/pause", {});
  assert.equal(paused.accepted, true);
  await phase(client, kPaused);
  await assert.rejects(client.call("/sls/pause", {}), /\/sls\/pause refused: /);
  await assert.rejects(client.call("/sls/step", { steps: 0 }), /expected a whole number/);

  // The reply to a pause may name the step in work, which is still finished; that to a step request is exact.
  const { step } = await client.call("/sls/step", {});
  assert.ok([paused.step + 1, paused.step + 2].includes(step));
  const stepped = await client.call("/sls/step", { steps: 3 });
  assert.equal(stepped.step, step + 3);
  const read = makeReader(client.channels.get("sls/state"));
  // The state of the current step may not be published before the run continues.
  const state = await waitFor("the state after three steps", () => {
    const last = read(client.messages.get("sls/state").at(-1).data);
    return Number(last.step) >= stepped.step - 1 ? last : undefined;
  });
  assert.ok(Number(state.step) <= stepped.step);

  const resumed = await client.call("/sls/resume", {});
  assert.equal(resumed.accepted, true);
  await phase(client, kRunning);
  await waitFor("further steps", () =>
    Number(read(client.messages.get("sls/state").at(-1).data).step) > stepped.step + 50);

  const session = client.serverInfos.at(-1).sessionId;
  assert.equal((await client.call("/sls/reset", {})).accepted, true);
  await waitFor("a new session", () => client.serverInfos.at(-1).sessionId !== session);
  assert.equal((await client.call("/sls/stop", {})).accepted, true);
});

test("a viewer that is read-only offers no services and refuses calls", async (t) => {
  const { domain } = await startPublisher(t, "hold");
  const view = await startView(t, domain, ["--read-only"]);
  const client = new Client(t, view.url);
  await client.channel("sls/state");
  client.client.sendServiceCallRequest({
    serviceId: 2, callId: 5, encoding: "json", data: new TextEncoder().encode("{}") });
  const failure = await waitFor("a failure", () => client.failures[0]);
  assert.equal(failure.callId, 5);
  assert.match(failure.message, /not allowed.*read-only/);
  assert.equal(client.services.size, 0);
});
