// Reads FOLDER/sls.mcap with the libraries of MCAP and Foxglove and compares every message with
// the recording's CSV files:
//     node judge.mjs FOLDER [--file FILE] [--cut] [--joined FOLDER2…]
// --cut: the recorder was killed; the file has no summary, and the last steps may be missing.
// --joined: the later segments; FILE has the steps of all.
// Prints the numbers of messages and records as JSON. On a difference it prints the difference on
// stderr and exits with code 1.
import { createRequire } from "node:module";
import { existsSync, readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const require = createRequire(join(here, "../../../tools/view/package.json"));
const { crc32 } = require("@foxglove/crc");
const { McapIndexedReader, McapStreamReader } = require("@mcap/core");
const { parseIDL } = require("@foxglove/omgidl-parser");
const { MessageReader: IdlReader } = require("@foxglove/omgidl-serialization");
const { parse: parseRos } = require("@foxglove/rosmsg");
const { MessageReader: RosReader } = require("@foxglove/rosmsg2-serialization");
const fzstd = require("fzstd");

const decompressHandlers = { zstd: (bytes, size) => fzstd.decompress(bytes, new Uint8Array(Number(size))) };

function expect(holds, text) {
  if (!holds) throw new Error(text);
}

function expectEqual(found, expected, text) {
  expect(Object.is(found, expected) || found === expected, `${text}: expected ${expected}, got ${found}`);
}

// --- CSV ---------------------------------------------------------------------------------------

/** Rows by "vehicle step", in the file's order; a last line without a line break does not count. */
function readCsv(path) {
  const rows = new Map();
  if (!existsSync(path)) return rows;
  const lines = readFileSync(path, "utf8").split("\n");
  const names = lines[0].split(",");
  for (const line of lines.slice(1, -1)) {
    const fields = line.split(",");
    expectEqual(fields.length, names.length, `${path}: fields of a row`);
    const row = Object.fromEntries(names.map((name, i) => [name, fields[i]]));
    rows.set(`${row.vehicle_id} ${row.step}`, row);
  }
  return rows;
}

const kWords = { nan: NaN, "-nan": NaN, inf: Infinity, "-inf": -Infinity };
const number = (text) => (text in kWords ? kWords[text] : Number(text));
const vector = (row, names) => names.map((name) => number(row[name]));
const xyz = (row, before, after) => vector(row, ["x", "y", "z"].map((axis) => before + axis + after));

// --- expected content of a message -------------------------------------------------------------

const kStateColumns = 22;
const none = (count) => Array(count).fill(NaN);

function expectNumbers(found, expected, text) {
  expectEqual(found.length, expected.length, `${text}: length`);
  expected.forEach((value, i) => {
    // Object.is distinguishes −0 from 0, and NaN equals NaN.
    expect(Object.is(found[i], value), `${text}[${i}]: expected ${value}, got ${found[i]}`);
  });
}

function expectState(state, row, text) {
  expectNumbers(state.p_WQ_m, row ? xyz(row, "quad_", "_m") : none(3), `${text}.p_WQ_m`);
  if (!row) return;
  expectNumbers(state.v_WQ_m_s, xyz(row, "quad_v", "_m_s"), `${text}.v_WQ_m_s`);
  expectNumbers(state.p_WL_m, xyz(row, "load_", "_m"), `${text}.p_WL_m`);
  expectNumbers(state.v_WL_m_s, xyz(row, "load_v", "_m_s"), `${text}.v_WL_m_s`);
  for (const name of ["alpha_rad", "beta_rad", "alpha_dot_rad_s", "beta_dot_rad_s"])
    expectNumbers([state[name]], [number(row[name])], `${text}.${name}`);
  const turns = "att_w" in row;
  expectNumbers(state.q_WB, turns ? vector(row, ["att_w", "att_x", "att_y", "att_z"]) : [1, 0, 0, 0], `${text}.q_WB`);
  expectNumbers(state.w_WB_B_rad_s, turns ? xyz(row, "rate_", "_rad_s") : [0, 0, 0], `${text}.w_WB_B_rad_s`);
  const signals = Object.keys(row).slice(kStateColumns + (turns ? 7 : 0));
  expectNumbers(state.signals, vector(row, signals), `${text}.signals`);
}

const kFaults = ["none", "free_fall", "rod_level", "not_finite", "stage_timeout"];

function expectEntry(entry, files, key) {
  const [state, measured, command, reference] = files.map((file) => file.get(key));
  expectEqual(`${entry.vehicle_id} ${entry.step}`, key, "vehicle and step");
  expectState(entry.truth, state, `${key}: truth`);
  expectNumbers(entry.f_Q_W_n, xyz(state, "force_", "_n"), `${key}: f_Q_W_n`);
  expectEqual(entry.measured.length, measured ? 1 : 0, `${key}: measured states`);
  if (measured) expectState(entry.measured[0], measured, `${key}: measured`);
  const kind = !command ? 0 : command.fault === "held" ? 2 : command.fault === "fail_safe" ? 3 : 1;
  expectEqual(entry.kind, kind, `${key}: kind`);
  const answer = entry.answer;
  expectEqual(answer.vehicle_id, entry.vehicle_id, `${key}: answer.vehicle_id`);
  expectNumbers(answer.f_Q_W_n, command ? xyz(command, "force_", "_n") : none(3), `${key}: answer.f_Q_W_n`);
  expectEqual(entry.client_name, command ? command.controller : "", `${key}: client_name`);
  expectEqual(entry.answered_step, kind === 1 ? entry.step : 0n, `${key}: answered_step`);
  if (kind === 1) expectEqual(answer.fault, kFaults.indexOf(command.fault), `${key}: fault`);
  expectEqual(answer.compute_time_ns, 0n, `${key}: compute time`);
  expectEqual(answer.controller.numbers.length, 0, `${key}: controller's memory`);
  const follows = answer.reference;
  expectEqual(follows.stage_name, reference ? reference.stage_name : "", `${key}: stage_name`);
  expectEqual(follows.stage_index, reference ? Number(reference.stage) : 0, `${key}: stage_index`);
  const parts = [["position_m", "", "_m"], ["velocity_m_s", "v", "_m_s"], ["acceleration_m_s2", "a", "_m_s2"],
    ["jerk_m_s3", "j", "_m_s3"], ["snap_m_s4", "s", "_m_s4"]];
  for (const [field, letter, unit] of parts)
    expectNumbers(follows[field], reference ? xyz(reference, `ref_${letter}`, unit) : none(3), `${key}: ${field}`);
}

// --- decoding ----------------------------------------------------------------------------------

function makeDecoder(schema) {
  const text = new TextDecoder().decode(schema.data);
  if (schema.encoding === "omgidl") {
    const reader = new IdlReader(schema.name, parseIDL(text));
    return (data) => reader.readMessage(data);
  }
  expectEqual(schema.encoding, "ros2msg", `schema ${schema.name}: encoding`);
  const reader = new RosReader(parseRos(text, { ros2: true }));
  return (data) => reader.readMessage(data);
}

/** Decodes the messages of either reader, and compares records with the CSV files. */
class Messages {
  constructor(files, periodNs) {
    this.files = files;
    this.periodNs = periodNs;
    this.decoders = new Map();
    this.keys = [];
    this.counts = new Map();
    this.mirrored = new Map();
  }

  add(message, channel, schema) {
    expectEqual(channel.messageEncoding, "cdr", `${channel.topic}: encoding`);
    if (!this.decoders.has(channel.id)) this.decoders.set(channel.id, makeDecoder(schema));
    const value = this.decoders.get(channel.id)(message.data);
    this.counts.set(channel.topic, (this.counts.get(channel.topic) ?? 0) + 1);
    expectEqual(message.logTime, message.publishTime, `${channel.topic}: publish time`);
    const vehicle = /^\/sls\/vehicle_(\d+)\/record$/.exec(channel.topic);
    if (!vehicle) return this.addMirror(channel.topic, message, value);
    const key = `${vehicle[1]} ${value.step}`;
    expectEqual(message.logTime, value.step * this.periodNs, `${channel.topic}: log time of step ${value.step}`);
    expectEqual(message.sequence, Number(value.step), `${channel.topic}: sequence`);
    expectEntry(value, this.files, key);
    this.keys.push(key);
  }

  addMirror(topic, message, value) {
    if (!this.mirrored.has(topic)) this.mirrored.set(topic, []);
    this.mirrored.get(topic).push({ time: message.logTime, value });
  }
}

async function readIndexed(bytes, messages) {
  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)),
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  const statistics = reader.statistics;
  const found = new Map();
  let count = 0n, first, last;
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    const channel = reader.channelsById.get(message.channelId);
    messages.add(message, channel, reader.schemasById.get(channel.schemaId));
    found.set(message.channelId, (found.get(message.channelId) ?? 0n) + 1n);
    first = first === undefined || message.logTime < first ? message.logTime : first;
    last = last === undefined || message.logTime > last ? message.logTime : last;
    ++count;
  }
  expectEqual(statistics.messageCount, count, "statistics: messages");
  expectEqual(statistics.messageStartTime, first ?? 0n, "statistics: first time");
  expectEqual(statistics.messageEndTime, last ?? 0n, "statistics: last time");
  expectEqual(statistics.schemaCount, reader.schemasById.size, "statistics: schemas");
  expectEqual(statistics.channelCount, reader.channelsById.size, "statistics: channels");
  expectEqual(statistics.chunkCount, reader.chunkIndexes.length, "statistics: chunks");
  expectEqual(statistics.attachmentCount, reader.attachmentIndexes.length, "statistics: attachments");
  for (const [id, of] of statistics.channelMessageCounts)
    expectEqual(of, found.get(id) ?? 0n, `statistics: messages of channel ${id}`);
  expect(reader.summaryOffsetsByOpcode.size > 0, "no summary offsets");
  const end = Number(reader.dataEndOffset);
  expectEqual(crc32(bytes.subarray(0, end)), reader.dataSectionCrc, "CRC of the data section");
  const attachments = {};
  for await (const attachment of reader.readAttachments({ validateCrcs: true })) {
    attachments[attachment.name] = Buffer.from(attachment.data);
    expectEqual(attachment.logTime, 0n, "log time of an attachment");
    expectEqual(attachment.createTime, 0n, "create time of an attachment");
  }
  return { attachments, chunks: reader.chunkIndexes.length };
}

/** Reads in pieces, as from a network, to the end of the bytes. */
function readStream(bytes, messages) {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  const schemas = new Map(), channels = new Map();
  const counts = {};
  const kPiece = 100_000;
  for (let from = 0; from < bytes.length; from += kPiece) {
    reader.append(bytes.subarray(from, from + kPiece));
    for (let record; (record = reader.nextRecord()); ) {
      counts[record.type] = (counts[record.type] ?? 0) + 1;
      if (record.type === "Schema") schemas.set(record.id, record);
      if (record.type === "Channel") channels.set(record.id, record);
      if (record.type !== "Message") continue;
      const channel = channels.get(record.channelId);
      messages.add(record, channel, schemas.get(channel.schemaId));
    }
  }
  return { done: reader.done(), counts };
}

// --- whole recordings --------------------------------------------------------------------------

function readFiles(folders) {
  const names = ["state.csv", "measured.csv", "command.csv", "reference.csv"];
  return names.map((name) => {
    const all = new Map();
    folders.forEach((folder, i) => {
      const next = folders[i + 1];
      const end = next ? JSON.parse(readFileSync(join(next, "manifest.json"))).segment.first_step : Infinity;
      for (const [key, row] of readCsv(join(folder, name))) if (Number(row.step) < end) all.set(key, row);
    });
    return all;
  });
}

/** A vehicle is mirrored at its first step in each 10 ms; its position has y and z negated. */
function expectMirrors(messages, vehicleIds, isCut) {
  for (const id of vehicleIds) {
    let slot = -1n;
    const steps = messages.keys.filter((key) => {
      const [vehicle, step] = key.split(" ");
      const of = (BigInt(step) * messages.periodNs) / 10_000_000n;
      if (Number(vehicle) !== id || of <= slot || !messages.files[0].has(key)) return false;
      slot = of;
      return true;
    });
    const name = `/sls/vehicle_${id}/quadrotor/odometry`;
    const found = messages.mirrored.get(name) ?? [];
    // In a cut file the last chunk may end between a step and its mirrors.
    expect(found.length === steps.length || (isCut && found.length + 1 === steps.length), `${name}: count`);
    found.forEach(({ time, value }, i) => {
      const row = messages.files[0].get(steps[i]);
      expectEqual(time, BigInt(row.step) * messages.periodNs, `${name}: time`);
      const { x, y, z } = value.pose.pose.position;
      const [quadX, quadY, quadZ] = xyz(row, "quad_", "_m");
      expect(x === quadX && y === -quadY && z === -quadZ, `${name}: position at step ${row.step}`);
    });
  }
  expect(!messages.mirrored.has("/clock"), "/clock is not in files");
  expectEqual(messages.mirrored.get("/tf_static")?.length, 1, "/tf_static: messages");
}

/** One load on cables, drawn from the columns of state.csv: its attitude, each cable, the load once. */
function expectCables(messages, vehicleIds) {
  const near = (a, b) => a.length === b.length && a.every((value, i) => Math.abs(value - b[i]) < 1e-9);
  const list = ({ x, y, z }) => [x, y, z];
  const counts = { taut: 0, slack: 0, cut: 0 };
  const rowOf = (id, time) => messages.files[0].get(`${id} ${BigInt(time) / messages.periodNs}`);
  if (!("cable_taut" in messages.files[0].values().next().value)) return counts;
  for (const id of vehicleIds) {
    for (const { time, value } of messages.mirrored.get(`/sls/vehicle_${id}/load/pose`)) {
      const [w, x, y, z] = vector(rowOf(id, time), ["w", "x", "y", "z"].map((axis) => `load_att_${axis}`));
      const { orientation: q } = value.pose;
      expect(near([q.w, q.x, q.y, q.z], [w, x, -y, -z]), `attitude of the load at ${time}`);
    }
    for (const { time, value } of messages.mirrored.get(`/sls/vehicle_${id}/markers`)) {
      const row = rowOf(id, time);
      const cable = value.markers.find((marker) => marker.id === 1);
      const points = cable.points.map(list);
      const state = row.cable_released === "1" ? "cut" : row.cable_taut === "1" ? "taut" : "slack";
      ++counts[state];
      expectEqual(cable.action, state === "cut" ? 2 : 0, `cable at ${time}: action`);
      const ends = ["quad_", "load_"].map((name) => xyz(row, name, "_m")).map(([x, y, z]) => [x, -y, -z]);
      expect(near(points[0], ends[0]) && near(points.at(-1), ends[1]), `cable at ${time}: ends`);
      const length = points.slice(1).reduce((sum, point, i) => sum + Math.hypot(...point.map((p, axis) => p - points[i][axis])), 0);
      // A curve in 24 parts is a little shorter; one that lies on the ground is drawn without its folds.
      const ratio = length / Number(row.cable_length_m);
      const mayLie = state === "slack" && "load_on_ground" in row;
      if (state !== "cut" && !mayLie) expect(ratio < 1 + 1e-6 && ratio > 0.995, `cable at ${time}: length ${length}`);
      const hasLoad = value.markers.some((marker) => marker.id === 2);
      expectEqual(hasLoad, id === Math.min(...vehicleIds), `load drawn with vehicle ${id}`);
    }
  }
  return counts;
}

async function main(options) {
  const value = (name) => {
    const at = options.indexOf(name);
    return at < 0 ? undefined : options.slice(at + 1);
  };
  const folder = options[0];
  const file = value("--file")?.[0] ?? join(folder, "sls.mcap");
  const isCut = options.includes("--cut");
  const manifest = JSON.parse(readFileSync(join(folder, "manifest.json")));
  const files = readFiles([folder, ...(value("--joined") ?? [])]);
  const periodNs = BigInt(Math.round(manifest.period_s * 1e9));
  const bytes = readFileSync(file);
  const streamed = new Messages(files, periodNs);
  const stream = readStream(bytes, streamed);
  expectEqual(stream.done, !isCut, "the stream reader has found the end");
  const states = [...files[0].keys()];
  expectEqual(new Set(streamed.keys).size, streamed.keys.length, "steps that are there once");
  if (!isCut) expectEqual(streamed.keys.join(), states.join(), "steps in the order of state.csv");
  else expectEqual(streamed.keys.join(), states.slice(0, streamed.keys.length).join(), "steps from the first one");
  expectMirrors(streamed, manifest.vehicle_ids, isCut);
  const cables = expectCables(streamed, manifest.vehicle_ids);
  const result = { cables, messages: Object.fromEntries(streamed.counts), records: stream.counts };
  if (!isCut) {
    const indexed = new Messages(files, periodNs);
    const { attachments, chunks } = await readIndexed(bytes, indexed);
    expectEqual(JSON.stringify([...indexed.counts].sort()), JSON.stringify([...streamed.counts].sort()),
      "both readers find the same messages");
    const scenario = readFileSync(join(folder, "scenario.yaml"));
    expect(attachments["scenario.yaml"].equals(scenario), "attached scenario differs");
    const attached = JSON.parse(attachments["manifest.json"]);
    for (const key of ["scenario_sha256", "contract_sha256", "period_s"])
      expectEqual(attached[key], manifest[key], `attached manifest: ${key}`);
    expectEqual(String(attached.vehicle_ids), String(manifest.vehicle_ids), "attached manifest: vehicle_ids");
    expectEqual(JSON.stringify(attached.signals), JSON.stringify(manifest.signals ?? []), "attached manifest: signals");
    expectEqual(attached.compression.library, "zstd", "attached manifest: compression");
    result.chunks = chunks;
  }
  console.log(JSON.stringify(result));
}

main(process.argv.slice(2)).catch((error) => {
  console.error(error.stack);
  process.exitCode = 1;
});
