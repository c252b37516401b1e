// Channels, messages and times of the flight of publisher.cpp, read with Foxglove's own client.
import assert from "node:assert/strict";
import { test } from "node:test";
import { WebSocket } from "ws";
import { Client, makeReader, startPublisher, startView, waitFor } from "./support.mjs";

const kPeriod = 4_000_000n;

async function start(t, args) {
  const publisher = await startPublisher(t, "publish");
  const view = await startView(t, publisher.domain, args);
  return { publisher, view };
}

test("every channel decodes to what was published, by either protocol", async (t) => {
  const { view } = await start(t);
  for (const protocol of ["foxglove.websocket.v1", "foxglove.sdk.v1"]) {
    const client = new Client(t, view.url, protocol);
    await client.channel("/sls/vehicle_7/markers");
    assert.equal(client.ws.protocol, protocol);
    const topics = [...client.channels.keys()];
    for (const topic of topics) await client.subscribe(topic);
    const decoded = new Map();
    for (const topic of topics) {
      const message = await client.message(topic);
      decoded.set(topic, { ...message, value: makeReader(client.channels.get(topic))(message.data) });
    }
    assert.deepEqual(client.errors, []);
    judgeLoop(decoded);
    judgeLatched(decoded);
    judgeMirrors(decoded);
  }
});

function judgeLoop(decoded) {
  const state = decoded.get("sls/state");
  const step = Number(state.value.step);
  assert.equal(state.value.run_id, 0x1111n);
  assert.equal(state.value.sim_time_ns, state.timestamp);
  assert.equal(state.timestamp, state.value.step * kPeriod);
  assert.deepEqual(state.value.vehicles.map((vehicle) => vehicle.vehicle_id), [0, 7]);
  const { measured, controller, controller_name: name } = state.value.vehicles[1];
  assert.deepEqual([...measured.p_WQ_m], [0.01 * step, 9, -3]);
  assert.deepEqual([...measured.w_WB_B_rad_s], [0.1, 0.2, 0.3]);
  assert.equal(measured.alpha_rad, 0.001 * step);
  assert.deepEqual([...measured.signals], [4711]);
  assert.deepEqual([...controller.numbers], [step, 2.5]);
  assert.equal(name, "pilot");

  const command = decoded.get("sls/command");
  assert.equal(command.timestamp, command.value.step * kPeriod);
  assert.equal(command.value.strength, -5);
  assert.deepEqual([...command.value.vehicles[0].f_Q_W_n], [1.5, -2.5, -16]);
  assert.equal(command.value.vehicles[0].reference.stage_name, "hover");

  const record = decoded.get("sls/record");
  const entry = record.value.entries[0];
  assert.equal(record.timestamp, entry.step * kPeriod);
  assert.equal(entry.kind, 1);
  assert.equal(entry.truth.alpha_rad, 0.001 * Number(entry.step));
}

function judgeLatched(decoded) {
  const status = decoded.get("sls/status");
  assert.equal(status.timestamp, status.value.step * kPeriod);
  assert.equal(status.value.timing, "real-time, 0 of 7 late");
  assert.equal(status.value.counters.resent, 3n);
  const parameters = decoded.get("sls/parameters").value;
  assert.equal(parameters.scenario_text, "name: played");
  assert.equal(parameters.period_ns, kPeriod);
  assert.deepEqual([...decoded.get("sls/participant").value.vehicle_ids], [0, 7]);
  assert.equal(decoded.get("sls/participant").value.host, "here");
  assert.equal(decoded.get("sls/control").value.operator_name, "anna@ground");
  const reply = decoded.get("sls/control_reply").value;
  assert.equal(reply.accepted, false);
  assert.equal(reply.reason, "played");
}

/** Mirrors follow REP-103, with z up and y left; sls/record has z down and y right. */
function judgeMirrors(decoded) {
  const odometry = decoded.get("/sls/vehicle_7/quadrotor/odometry");
  const { sec, nanosec } = odometry.value.header.stamp;
  const stamp = BigInt(sec) * 1_000_000_000n + BigInt(nanosec);
  assert.equal(stamp, odometry.timestamp);
  const { x, y, z } = odometry.value.pose.pose.position;
  assert.ok(Math.abs(x - 0.01 * Number(stamp / kPeriod)) < 1e-9);
  assert.equal(y, -9);
  assert.equal(z, 3);
  assert.deepEqual(odometry.value.twist.twist.linear, { x: 0.5, y: 0.25, z: -0.125 });
  assert.equal(decoded.get("/sls/vehicle_7/load/pose").value.pose.position.z, 2);
  const clock = decoded.get("/clock");
  assert.equal(BigInt(clock.value.clock.sec) * 1_000_000_000n + BigInt(clock.value.clock.nanosec),
    clock.timestamp);
  assert.ok(decoded.get("/tf").value.transforms.length > 0);
  assert.equal(decoded.get("/tf_static").value.transforms[0].child_frame_id, "world_z_down");
  assert.ok(decoded.get("/sls/vehicle_0/markers").value.markers.length > 0);
}

test("time comes from the simulation and a reset is a new session", async (t) => {
  const { publisher, view } = await start(t);
  const client = new Client(t, view.url);
  await client.subscribe("/sls/vehicle_7/load/pose");
  await client.subscribe("sls/state");
  await waitFor("times", () => client.times.length > 20);
  const times = client.times.slice();
  times.forEach((time, i) => {
    assert.equal(time % kPeriod, 0n);
    if (i > 0) assert.ok(time >= times[i - 1]);
  });
  assert.ok(client.serverInfos.at(-1).capabilities.includes("time"));
  const stateId = client.channels.get("sls/state").id;
  publisher.say("reset");
  await waitFor("another session", () => client.serverInfos.at(-1).sessionId === "0000000000001112");
  await client.channel("/sls/vehicle_9/load/pose");
  assert.ok(client.unadvertised.includes("/sls/vehicle_7/load/pose"));
  assert.ok(!client.unadvertised.includes("/sls/vehicle_0/load/pose"));
  assert.equal(client.channels.get("sls/state").id, stateId);
  // The subscription stays active, and time starts again.
  const count = client.messages.get("sls/state").length;
  const next = await client.message("sls/state", count + 5);
  assert.equal(makeReader(client.channels.get("sls/state"))(next.data).run_id, 0x1112n);
  assert.ok(client.times.at(-1) < times.at(-1) + 100n * 1_000_000_000n);
  assert.deepEqual(client.errors, []);
});

test("all vehicles of a fleet of 100 are mirrored", async (t) => {
  const { publisher, view } = await start(t);
  publisher.say("fleet 100");
  const client = new Client(t, view.url);
  await client.channel("/sls/vehicle_99/markers");
  const ids = [...Array(100).keys()];
  for (const id of ids) await client.subscribe(`/sls/vehicle_${id}/load/pose`);
  for (const id of ids) {
    const topic = `/sls/vehicle_${id}/load/pose`;
    const { data } = await client.message(topic, 2);
    const { position } = makeReader(client.channels.get(topic))(data).pose;
    assert.equal(position.y, -2 - id);
  }
  assert.deepEqual(client.errors, []);
});

test("a client that does not read loses messages and is told so", async (t) => {
  const { publisher, view } = await start(t);
  const slow = new Client(t, view.url), fast = new Client(t, view.url);
  for (const client of [slow, fast]) await client.subscribe("sls/state");
  await fast.message("sls/state");
  await slow.message("sls/state");
  slow.ws.pause();
  publisher.say("rest");
  // More than the client's queue and the socket buffers can hold.
  for (let i = 0; i < 4; ++i) {
    publisher.say("burst 10000 1");
    await waitFor("the end of the burst", () => publisher.lines.shift());
  }
  slow.ws.resume();
  const told = await waitFor("the word of it", () =>
    slow.statuses.find((status) => /messages dropped: the client is slow/.test(status.message)));
  assert.equal(told.level, 1);
  assert.ok(Number.parseInt(told.message) > 0);
  assert.equal(fast.closed, undefined);
  assert.ok(fast.messages.get("sls/state").length > slow.messages.get("sls/state").length);
});

test("bad messages are answered in words and end with 1008", async (t) => {
  const { view } = await start(t);
  const client = new Client(t, view.url);
  await client.channel("sls/state");
  client.client.advertise({ topic: "/cmd", encoding: "json", schemaName: "a" });
  client.client.sendMessage(1, new Uint8Array([1, 2, 3]));
  client.client.unsubscribe(12);
  client.client.getParameters([], "x");
  client.client.fetchAsset("package://x", 1);
  client.client.sendServiceCallRequest({
    serviceId: 1, callId: 1, encoding: "json", data: new Uint8Array([123, 125]) });
  client.ws.send("{");
  await waitFor("answers", () => client.statuses.filter((status) => status.level === 2).length >= 6);
  assert.equal(client.closed, undefined);
  for (let i = 0; i < 40; ++i) client.ws.send("nonsense");
  await waitFor("the end", () => client.closed);
  assert.equal(client.closed.code, 1008);
  // Other clients are still served.
  const other = new Client(t, view.url);
  await other.subscribe("sls/state");
  await other.message("sls/state");
});

test("a page of another origin looks only where it is allowed, and never operates", async (t) => {
  const origin = "https://app.foxglove.dev";
  const { publisher, view } = await start(t);
  const refused = new WebSocket(view.url, ["foxglove.sdk.v1"], { origin });
  const error = await new Promise((resolve) => refused.once("error", resolve));
  assert.match(error.message, /403/);
  // Desktop programs made with Electron send the origin file://.
  const open = await startView(t, publisher.domain, [
    "--allow-origin", origin, "--allow-origin", "file://"]);
  for (const page of [origin, "file://"]) {
    const client = new Client(t, open.url, "foxglove.sdk.v1", { origin: page });
    await client.subscribe("sls/state");
    await client.message("sls/state");
    assert.ok(!client.serverInfos.at(-1).capabilities.includes("services"));
    assert.equal(client.services.size, 0);
  }
});
