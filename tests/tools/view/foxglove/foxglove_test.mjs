// A flight of the real programs, operated and read with Foxglove's own code, and the layout config/foxglove/sls.json.
import assert from "node:assert/strict";
import { parseIDL } from "@foxglove/omgidl-parser";
import { parse as parseRos } from "@foxglove/rosmsg";
import { readFileSync } from "node:fs";
import { hostname } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { WebSocket } from "ws";
import { root, startFlight } from "../flight.mjs";
import { waitFor } from "../page/browser.mjs";
import { Client } from "./client.mjs";

const kPaused = 2, kRunning = 1; // RunPhase
const kPeriod = 4_000_000n;

let flight, view;
before(async () => {
  flight = await startFlight({ base: "multirotor_figure_eight" });
  view = await flight.startViewer();
});
after(() => flight?.stop());

test("an operator pauses, steps and resumes the flight", async (t) => {
  const client = new Client(t, view.url);
  for (const topic of ["sls/status", "sls/state"]) await client.subscribe(topic);
  const untilStep = (step) => client.until("sls/state", (state) => Number(state.step) >= step);
  await client.until("sls/status", ({ phase }) => phase === kRunning);
  assert.ok(client.serverInfos.at(-1).capabilities.includes("services"));

  const paused = await client.call("/sls/pause");
  assert.equal(paused.accepted, true);
  await client.until("sls/status", ({ phase }) => phase === kPaused);
  await assert.rejects(client.call("/sls/pause"), /\/sls\/pause refused: /);
  await assert.rejects(client.call("/sls/step", { steps: 0 }), /expected a whole number/);

  // The reply to a pause may name the step in work, which is still finished; that to a step request is exact.
  const { step } = await client.call("/sls/step");
  assert.ok([paused.step + 1, paused.step + 2].includes(step));
  const stepped = await client.call("/sls/step", { steps: 3 });
  assert.equal(stepped.step, step + 3);
  // The state of the current step may not be published before the run continues.
  assert.ok(Number((await untilStep(stepped.step - 1)).step) <= stepped.step);

  assert.equal((await client.call("/sls/resume")).accepted, true);
  await client.until("sls/status", ({ phase }) => phase === kRunning);
  await untilStep(stepped.step + 50);
});

test("every channel decodes by either protocol, and all have the same flight", async (t) => {
  for (const protocol of ["foxglove.websocket.v1", "foxglove.sdk.v1"]) {
    const client = new Client(t, view.url, protocol);
    await client.channel("/sls/vehicle_0/markers");
    assert.equal(client.ws.protocol, protocol);
    for (const topic of client.channels.keys()) await client.subscribe(topic);
    for (const topic of ["sls/record", "/sls/vehicle_0/load/odometry"]) await client.read(topic, 10);
    const found = new Map();
    for (const topic of client.channels.keys()) found.set(topic, await client.read(topic));
    assert.deepEqual(client.errors, []);
    judgeLatched(found, BigInt(`0x${client.serverInfos.at(-1).sessionId}`));
    judgeLoop(found);
    judgeMirrors(found);
  }
});

function judgeLatched(found, run) {
  const last = (topic) => found.get(topic).at(-1).value;
  for (const topic of ["state", "command", "record", "participant", "parameters", "status", "control", "control_reply"])
    assert.equal(last(`sls/${topic}`).run_id, run, topic);
  const [status] = found.get("sls/status");
  assert.equal(status.timestamp, status.value.step * kPeriod);
  assert.equal(last("sls/parameters").scenario_text, readFileSync(join(flight.folder, "scenario.yaml"), "utf8"));
  assert.equal(last("sls/parameters").period_ns, kPeriod);
  const participants = found.get("sls/participant").map(({ value }) => value);
  assert.deepEqual([...new Set(participants.map(({ name }) => name))].sort(), ["control_client", "recorder"]);
  for (const { host } of participants) assert.equal(host, hostname());
  assert.match(last("sls/control").operator_name, /@/);
  assert.equal(last("sls/control_reply").accepted, true);
}

function judgeLoop(found) {
  const byStep = (topic) => new Map(found.get(topic).map((message) => [message.value.step, message]));
  const states = byStep("sls/state"), commands = byStep("sls/command");
  const entries = found.get("sls/record").flatMap(({ value }) => [...value.entries]);
  for (const { timestamp, value } of found.get("sls/record")) assert.equal(timestamp, value.entries[0].step * kPeriod);
  const shared = entries.filter(({ step, kind }) => kind === 1 && states.has(step) && commands.has(step));
  assert.ok(shared.length > 0, `${shared.length} of ${entries.length} entries`);
  for (const { step, truth, answer } of shared) {
    const state = states.get(step), command = commands.get(step);
    assert.equal(state.timestamp, step * kPeriod);
    assert.equal(state.value.sim_time_ns, state.timestamp);
    assert.equal(command.timestamp, state.timestamp);
    assert.deepEqual(state.value.vehicles[0].measured.p_WQ_m, truth.p_WQ_m);
    assert.deepEqual(command.value.vehicles[0].f_Q_W_n, answer.f_Q_W_n);
    assert.equal(answer.reference.stage_name, "figure_eight");
  }
}

/** Mirrors follow REP-103, with z up and y left; sls/record has z down and y right. */
function judgeMirrors(found) {
  const kLate = 5;  // such an entry has no state
  const entries = found.get("sls/record").flatMap(({ value }) => [...value.entries]).filter(({ kind }) => kind !== kLate);
  const truths = new Map(entries.map(({ step, truth }) => [step * kPeriod, truth]));
  const toNs = ({ sec, nanosec }) => BigInt(sec) * 1_000_000_000n + BigInt(nanosec);
  const isUp = ({ x, y, z }, [forward, right, down]) => assert.deepEqual([x, -y, -z], [forward, right, down]);
  const odometry = found.get("/sls/vehicle_0/load/odometry").filter(({ timestamp }) => truths.has(timestamp));
  assert.ok(odometry.length > 0, "no odometry of a recorded step");
  for (const { timestamp, value } of odometry) {
    assert.equal(toNs(value.header.stamp), timestamp);
    isUp(value.pose.pose.position, truths.get(timestamp).p_WL_m);
    isUp(value.twist.twist.linear, truths.get(timestamp).v_WL_m_s);
  }
  const [clock] = found.get("/clock");
  assert.equal(toNs(clock.value.clock), clock.timestamp);
  assert.equal(found.get("/tf_static")[0].value.transforms[0].child_frame_id, "world_z_down");
  assert.ok(found.get("/sls/vehicle_0/markers")[0].value.markers.length > 0);
}

test("a page of another origin looks only where it is allowed, and never operates", async (t) => {
  const origin = "https://app.foxglove.dev";
  const refused = new WebSocket(view.url.replace("http", "ws"), ["foxglove.sdk.v1"], { origin });
  const error = await new Promise((resolve) => refused.once("error", resolve));
  assert.match(error.message, /403/);
  // Desktop programs made with Electron send the origin file://.
  const open = await flight.startViewer("--allow-origin", origin, "--allow-origin", "file://");
  for (const page of [origin, "file://"]) {
    const client = new Client(t, open.url, "foxglove.sdk.v1", { origin: page });
    await client.subscribe("sls/state");
    await client.read("sls/state");
    assert.ok(!client.serverInfos.at(-1).capabilities.includes("services"));
    assert.equal(client.services.size, 0);
  }
});

test("a viewer that is read-only offers no services and refuses calls", async (t) => {
  const readOnly = await flight.startViewer("--read-only");
  const client = new Client(t, readOnly.url);
  await client.channel("sls/state");
  assert.equal(client.services.size, 0);
  client.services.set("/sls/pause", { id: 2 });
  await assert.rejects(client.call("/sls/pause"), /not allowed.*read-only/);
});

// --- the layout ----------------------------------------------------------------------------------

const layout = JSON.parse(readFileSync(join(root, "config/foxglove/sls.json"), "utf8"));

/** Message paths of all panels: "topic.field[0]{filter==0}.field". */
function listPaths() {
  return Object.values(layout.configById).flatMap(({ paths = [], topicPath, path, topics = {} }) => [
    ...paths.map(({ value }) => value), ...[topicPath, path].filter(Boolean), ...Object.keys(topics)]);
}

function split(messagePath) {
  const [, topic, rest] = /^([\w/-]+)(.*)$/.exec(messagePath);
  const names = rest.replaceAll(/\{[^}]*\}/g, "").split(".").slice(1);
  return { topic, names, fields: names.map((name) => name.replace(/\[[^\]]*\]$/, "")) };
}

/** The definitions of a channel: name → fields. */
function readSchema(channel) {
  const definitions =
    channel.schemaEncoding === "omgidl"
      ? parseIDL(channel.schema).filter((one) => one.aggregatedKind !== "union")
      : parseRos(channel.schema, { ros2: true });
  return new Map(definitions.map((one) => [one.name ?? channel.schemaName, one.definitions]));
}

/** Throws if a field does not exist, is indexed but no array, or is an array but not indexed. */
function checkFields(channel, { names, fields }) {
  const schema = readSchema(channel);
  let type = schema.get(channel.schemaName) ?? schema.get(channel.schemaName.replace("/msg/", "/"));
  assert.ok(type, `${channel.topic}: no definition of ${channel.schemaName}`);
  fields.forEach((name, i) => {
    const field = type.find((one) => one.name === name);
    assert.ok(field, `${channel.topic}: no field ${name}`);
    const isArray = (field.isArray ?? false) || field.arrayLengths !== undefined;
    assert.equal(names[i] !== name, isArray, `${channel.topic}: ${name}: index and array`);
    type = schema.get(field.type);
    if (i + 1 < fields.length) assert.ok(type, `${channel.topic}: ${name} has no fields`);
  });
}

test("each topic, field, service and frame of the layout exists", async (t) => {
  const client = new Client(t, view.url);
  await client.channel("/sls/vehicle_0/markers");
  const paths = listPaths();
  // The markers of as many vehicles as one load can have.
  assert.equal(paths.filter((one) => /^\/sls\/vehicle_\d+\/markers$/.test(one)).length, 16);
  for (const messagePath of paths) {
    const wanted = split(messagePath.replace(/^\/sls\/vehicle_\d+/, "/sls/vehicle_0"));
    const channel = client.channels.get(wanted.topic);
    assert.ok(channel, `no channel ${wanted.topic}`);
    checkFields(channel, wanted);
  }
  for (const [id, config] of Object.entries(layout.configById))
    if (id.startsWith("CallService!"))
      assert.ok(client.services.has(config.serviceName), `no service ${config.serviceName}`);

  await client.subscribe("/tf");
  const [{ value }] = await client.read("/tf");
  const scene = layout.configById["3D!sls"];
  assert.ok(value.transforms.some((transform) => transform.child_frame_id === scene.followTf));
});

test("the layout shows every panel that it configures", () => {
  const shown = [];
  const collect = (node) =>
    typeof node === "string" ? shown.push(node) : (collect(node.first), collect(node.second));
  collect(layout.layout);
  assert.deepEqual(shown.sort(), Object.keys(layout.configById).sort());
});

test("a reset is a new session", async (t) => {
  const client = new Client(t, view.url);
  await client.channel("sls/state");
  const session = client.serverInfos.at(-1).sessionId;
  assert.equal((await client.call("/sls/reset")).accepted, true);
  await waitFor("a new session", () => client.serverInfos.at(-1).sessionId !== session);
  assert.equal((await client.call("/sls/stop")).accepted, true);
});
