// Decodes mirrors with @foxglove/rosmsg and @foxglove/rosmsg2-serialization, and compares the values with the samples.
// mirrors_dump, in the build tree SLS_BUILD, prints both; @foxglove/… is in node_modules of tests/tools/view.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { createRequire } from "node:module";
import path from "node:path";
import { test } from "node:test";
import { fileURLToPath } from "node:url";

const folder = path.dirname(fileURLToPath(import.meta.url));
const require = createRequire(path.join(folder, "../../tools/view/package.json"));
const { parse } = require("@foxglove/rosmsg");
const { MessageReader, MessageWriter } = require("@foxglove/rosmsg2-serialization");

const kTolerance = 1e-12; // of numbers that both sides compute: some 10 m and m/s
const dump = spawnSync(path.join(process.env.SLS_BUILD, "tests/mirrors_dump"), { maxBuffer: 1 << 28, encoding: "utf8" });
assert.equal(dump.status, 0, dump.stderr);
const lines = dump.stdout.trimEnd().split("\n").map((line) => JSON.parse(line));
const channels = lines.filter((line) => line.topic);
for (const channel of channels) {
  channel.definition = parse(channel.schema, { ros2: true });
  channel.reader = new MessageReader(channel.definition);
  channel.writer = new MessageWriter(channel.definition);
}

/** Messages as {topic, sim_time_ns, bytes, value, sample}; the static one has no sample. */
function decodeAll() {
  let sample;
  const messages = [];
  for (const line of lines) {
    if (line.sample) sample = line.sample;
    if (!line.cdr) continue;
    const bytes = Uint8Array.from(Buffer.from(line.cdr, "hex"));
    const channel = channels[line.channel];
    const value = channel.reader.readMessage(bytes);
    messages.push({ ...line, topic: channel.topic, writer: channel.writer, bytes, value, sample });
  }
  return messages;
}
const messages = decodeAll();
const of = (pattern) => messages.filter((message) => pattern.test(message.topic));

const up = ([x, y, z]) => [x, -y, -z]; // W, z down → world, z up
const list = ({ x, y, z }) => [x, y, z];
const near = (actual, expected) => {
  assert.equal(actual.length, expected.length);
  actual.forEach((number, i) => assert.ok(Math.abs(number - expected[i]) < kTolerance, `${actual} ${expected}`));
};
const minus = (a, b) => a.map((number, i) => number - b[i]);
const multiply = (matrix, v) => matrix.map((row) => row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);
const transpose = (m) => m[0].map((_, i) => m.map((row) => row[i]));
/** Columns are the axes of the body. */
function toMatrix([w, x, y, z]) {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
  ];
}
const matrixOf = ({ w, x, y, z }) => toMatrix([w, x, y, z]);
/** Axes forward, left, up of the body in world, from those forward, right, down in W. */
function expectedAxes(sample) {
  const [forward, right, down] = transpose(toMatrix(sample.q_WB)).map(up);
  return transpose([forward, right.map((n) => -n), down.map((n) => -n)]);
}
function expectStamp(message, header) {
  assert.equal(header.frame_id, "world");
  assert.equal(header.stamp.sec * 1e9 + header.stamp.nanosec, message.sample.sim_time_ns);
  assert.equal(message.sim_time_ns, message.sample.sim_time_ns);
}
const kIdentity = { x: 0, y: 0, z: 0, w: 1 };

test("every channel has messages, and their bytes are those that the judge's own writer makes", () => {
  for (const channel of channels) assert.ok(messages.some((message) => message.topic === channel.topic), channel.topic);
  for (const { topic, writer, value, bytes } of messages)
    assert.deepEqual(Buffer.from(writer.writeMessage(value)), Buffer.from(bytes), topic);
});

test("topics and types are those that ROS tools expect", () => {
  const types = Object.fromEntries(channels.map(({ topic, type }) => [topic, type]));
  const vehicle = (n) => ({
    [`/sls/vehicle_${n}/quadrotor/odometry`]: "nav_msgs/msg/Odometry",
    [`/sls/vehicle_${n}/load/odometry`]: "nav_msgs/msg/Odometry",
    [`/sls/vehicle_${n}/quadrotor/pose`]: "geometry_msgs/msg/PoseStamped",
    [`/sls/vehicle_${n}/load/pose`]: "geometry_msgs/msg/PoseStamped",
    [`/sls/vehicle_${n}/load/reference`]: "geometry_msgs/msg/PoseStamped",
    [`/sls/vehicle_${n}/markers`]: "visualization_msgs/msg/MarkerArray",
  });
  assert.deepEqual(types, {
    "/clock": "rosgraph_msgs/msg/Clock",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/tf_static": "tf2_msgs/msg/TFMessage",
    ...vehicle(0),
    ...vehicle(3),
  });
  assert.deepEqual(channels.filter((channel) => channel.is_latched).map(({ topic }) => topic), ["/tf_static"]);
});

test("the clock ticks once a step", () => {
  const steps = lines.filter((line) => line.sample?.vehicle_id === 0).map((line) => line.sample.sim_time_ns);
  const clock = of(/^\/clock$/).map(({ value }) => value.clock.sec * 1e9 + value.clock.nanosec);
  assert.deepEqual(clock, steps);
});

test("the static transform turns world_z_down half a turn about x", () => {
  const [{ value }, ...rest] = of(/^\/tf_static$/);
  assert.equal(rest.length, 0);
  const [{ header, child_frame_id, transform }] = value.transforms;
  assert.deepEqual([header.frame_id, child_frame_id], ["world", "world_z_down"]);
  assert.deepEqual(list(transform.translation), [0, 0, 0]);
  near(multiply(matrixOf(transform.rotation), [1, 2, 3]), [1, -2, -3]);
});

test("transforms place quadrotor and load, with x forward, y left, z up", () => {
  const found = of(/^\/tf$/);
  assert.equal(found.length, lines.filter((line) => line.sample).length);
  for (const message of found) {
    const { sample, value } = message;
    const [quadrotor, load] = value.transforms;
    value.transforms.forEach(({ header }) => expectStamp(message, header));
    assert.equal(quadrotor.child_frame_id, `vehicle_${sample.vehicle_id}/quadrotor`);
    assert.equal(load.child_frame_id, `vehicle_${sample.vehicle_id}/load`);
    near(list(quadrotor.transform.translation), up(sample.p_WQ));
    near(list(load.transform.translation), up(sample.p_WL));
    near(matrixOf(quadrotor.transform.rotation).flat(), expectedAxes(sample).flat());
    assert.deepEqual({ ...load.transform.rotation }, kIdentity);
  }
});

test("odometry has the pose in world and the velocities in the child frame", () => {
  for (const message of of(/odometry$/)) {
    const { sample, value, topic } = message;
    const { pose, twist } = { pose: value.pose.pose, twist: value.twist.twist };
    expectStamp(message, value.header);
    assert.equal(value.child_frame_id, topic.replace("/sls/", "").replace("/odometry", ""));
    const covariances = [...value.pose.covariance, ...value.twist.covariance];
    assert.ok(covariances.length === 72 && covariances.every((number) => number === 0));
    if (/load/.test(topic)) {
      near(list(pose.position), up(sample.p_WL));
      assert.deepEqual({ ...pose.orientation }, kIdentity);
      near(list(twist.linear), up(sample.v_WL));
      near(list(twist.angular), [0, 0, 0]);
    } else {
      const axes = expectedAxes(sample);
      near(list(pose.position), up(sample.p_WQ));
      near(matrixOf(pose.orientation).flat(), axes.flat());
      near(list(twist.linear), multiply(transpose(axes), up(sample.v_WQ)));
      near(list(twist.angular), up(sample.w_WB_B));
    }
  }
});

test("poses and reference are in world; a step without a reference has none", () => {
  const places = { "quadrotor/pose": "p_WQ", "load/pose": "p_WL", "load/reference": "reference" };
  for (const [suffix, name] of Object.entries(places)) {
    const found = messages.filter(({ topic }) => topic.endsWith(suffix));
    assert.equal(found.length, lines.filter((line) => line.sample?.[name]).length);
    for (const message of found) {
      expectStamp(message, message.value.header);
      near(list(message.value.pose.position), up(message.sample[name]));
      if (name === "p_WQ") near(matrixOf(message.value.pose.orientation).flat(), expectedAxes(message.sample).flat());
      else assert.deepEqual({ ...message.value.pose.orientation }, kIdentity);
    }
  }
});

test("markers draw body, rod, load and trails, every 50 ms of simulation time", () => {
  const [cube, sphere, lineStrip] = [1, 2, 4];
  const found = of(/vehicle_3\/markers$/);
  const fromStart = found.map(({ sim_time_ns }) => sim_time_ns / 1e6);
  assert.deepEqual(fromStart.slice(0, 5), [0, 52, 100, 152, 200]); // the first 4 ms step of each 50 ms
  assert.equal(found.length, 80);
  for (const message of found) {
    const { sample, value } = message;
    const [body, rod, load, trail, reference] = value.markers;
    value.markers.forEach((marker, i) => {
      expectStamp(message, marker.header);
      assert.deepEqual([marker.ns, marker.id, marker.action], ["vehicle_3", i, 0]);
      assert.ok(marker.color.a > 0 && marker.scale.x > 0);
    });
    const shapes = [cube, lineStrip, sphere, lineStrip, ...(sample.reference ? [lineStrip] : [])];
    assert.deepEqual(value.markers.map(({ type }) => type), shapes);
    near(list(body.pose.position), up(sample.p_WQ));
    near(matrixOf(body.pose.orientation).flat(), expectedAxes(sample).flat());
    near(rod.points.map(list).flat(), [...up(sample.p_WQ), ...up(sample.p_WL)]);
    near(list(load.pose.position), up(sample.p_WL));
    near(list(trail.points.at(-1)), up(sample.p_WL));
    if (reference) near(list(reference.points.at(-1)), up(sample.reference));
  }
});

test("trails are what the load and the reference have passed, and bounded", () => {
  const markers = of(/vehicle_0\/markers$/);
  const passed = new Set(markers.map(({ sample }) => JSON.stringify(up(sample.p_WL))));
  const lengths = markers.map(({ value }) => value.markers[3].points.length);
  for (const { value } of markers)
    for (const point of value.markers[3].points) assert.ok(passed.has(JSON.stringify(list(point))));
  assert.equal(lengths[0], 2); // a line needs two points
  assert.ok(lengths.every((length, i) => i === 0 || length >= lengths[i - 1]));
  assert.ok(lengths.at(-1) > 60 && Math.max(...lengths) <= 129);
  for (const [a, b] of markers.at(-1).value.markers[4].points.slice(0, -1).map((p, i, all) => [p, all[i + 1]]))
    if (b) assert.ok(Math.hypot(...minus(list(b), list(a))) >= 0.02);
});

test("no number is minus zero, where the text of a file would differ", () => {
  const visit = (value) => {
    if (typeof value === "number") assert.ok(!Object.is(value, -0));
    else if (value && typeof value === "object") Object.values(value).forEach(visit);
  };
  messages.forEach(({ value }) => visit(value));
});
