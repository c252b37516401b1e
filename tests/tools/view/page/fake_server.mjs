// Serves the subprotocol sls.view.1 with a flight from closed forms: each load flies a figure eight about its own
// centre, and its quadrotor is one rod length away. startFakeServer({ page, vehicles, … }) → { url, port, control, … }.
import { createServer } from "node:http";
import { readFileSync } from "node:fs";
import { WebSocketServer } from "ws";

export const kRunId = "00c0ffee00000001";
const kPeriod = 0.004;
const kPoseTime = 1000 / 60; // ms

const kColumns = [
  "quad_x_m", "quad_y_m", "quad_z_m", "quad_vx_m_s", "quad_vy_m_s", "quad_vz_m_s", "load_x_m", "load_y_m", "load_z_m",
  "load_vx_m_s", "load_vy_m_s", "load_vz_m_s", "alpha_rad", "beta_rad", "alpha_dot_rad_s", "beta_dot_rad_s", "force_x_n",
  "force_y_n", "force_z_n", "att_w", "att_x", "att_y", "att_z", "rate_x_rad_s", "rate_y_rad_s", "rate_z_rad_s",
  "ref_x_m", "ref_y_m", "ref_z_m", "rotor_0_rad_s", "rotor_1_rad_s", "rotor_2_rad_s", "rotor_3_rad_s",
];

/** Load of vehicle `id` at time t, frame W: the centres are 5 m apart, in rows of ten. */
export function calcLoad(id, t, vehicles) {
  const w = (2 * Math.PI) / 16;
  const row = vehicles > 1 ? Math.floor(id / 10) - 4.5 : 0;
  const place = vehicles > 1 ? (id % 10) - 4.5 : 0;
  return [5 * row + 1.5 * Math.sin(w * t), 5 * place + 0.75 * Math.sin(2 * w * t), -0.5 - 0.5 * Math.sin(w * t)];
}

export function calcQuad(id, t, vehicles) {
  const [x, y, z] = calcLoad(id, t, vehicles);
  const [alpha, beta] = [0.06 * Math.sin(0.8 * t), 0.08 * Math.cos(0.5 * t)];
  return [x - Math.sin(beta), y + Math.sin(alpha) * Math.cos(beta), z - Math.cos(alpha) * Math.cos(beta)];
}

function makeRun(vehicles) {
  const rotors = [[0.13, 0.22], [-0.13, -0.2], [0.13, -0.22], [-0.13, 0.2]];
  return {
    run_id: kRunId, scenario: vehicles > 1 ? "fleet" : "figure_eight", mode: "realtime", period_s: kPeriod,
    real_time_factor: 1, has_attitude: true,
    vehicles: Array.from({ length: vehicles }, (_, id) => ({
      id, quad_mass_kg: 1.5, load_mass_kg: 0.2, rod_length_m: 1, attachment_m: [0, 0, 0],
      rotors: rotors.map(([x, y], index) => ({ position_m: [x, y, 0], spin: index < 2 ? -1 : 1 })),
    })),
    columns: kColumns.map((name) => ({ name, unit: name.split("_").slice(2).join("/") || "1" })),
    stages: ["climb", "figure_eight", "return"],
    path_m: Array.from({ length: 400 }, (_, index) => calcLoad(0, (16 * index) / 399, vehicles)),
  };
}

function calcTilt(t) {
  const angle = 0.15 * Math.sin(t);
  return [Math.cos(angle / 2), Math.sin(angle / 2), 0, 0];
}

function packPoses(vehicles, step) {
  const t = step * kPeriod;
  const bytes = Buffer.alloc(40 + 64 * vehicles);
  bytes.writeUInt32LE(1, 0);
  bytes.writeUInt32LE(vehicles, 4);
  bytes.writeBigUInt64LE(BigInt(`0x${kRunId}`), 8);
  bytes.writeBigUInt64LE(BigInt(step), 16);
  bytes.writeDoubleLE(t, 24);
  bytes.writeDoubleLE(performance.timeOrigin + performance.now(), 32);
  for (let id = 0; id < vehicles; ++id) {
    const at = 40 + 64 * id;
    bytes.writeUInt32LE(id, at);
    bytes.writeUInt32LE(1, at + 4);
    const numbers = [...calcQuad(id, t, vehicles), ...calcTilt(t), ...calcLoad(id, t, vehicles),
                     ...calcLoad(id, t + 0.02, vehicles), 760];
    numbers.forEach((value, index) => bytes.writeFloatLE(value, at + 8 + 4 * index));
  }
  return bytes;
}

function packRows(vehicles, id, first, last) {
  const rows = last - first;
  const bytes = Buffer.alloc(24 + rows * 8 + rows * kColumns.length * 4);
  bytes.writeUInt32LE(2, 0);
  bytes.writeUInt32LE(id, 4);
  bytes.writeUInt32LE(rows, 8);
  bytes.writeUInt32LE(kColumns.length, 12);
  bytes.writeBigUInt64LE(BigInt(`0x${kRunId}`), 16);
  for (let i = 0; i < rows; ++i) {
    const t = (first + i) * kPeriod;
    bytes.writeDoubleLE(t, 24 + 8 * i);
    const [quad, load, reference] = [calcQuad(id, t, vehicles), calcLoad(id, t, vehicles), calcLoad(id, t + 0.02, vehicles)];
    const zero = [0, 0, 0];
    const force = [1.2 * Math.sin(t), 0.8 * Math.cos(1.3 * t), -16.66 + 0.4 * Math.sin(2 * t)];
    const rotors = [0, 1, 2, 3].map((rotor) => 760 + 25 * Math.sin(t + rotor));
    const values = [...quad, ...zero, ...load, Math.cos(t), Math.sin(t), 0.1, 0.06 * Math.sin(0.8 * t), 0.08 * Math.cos(0.5 * t),
                    0, 0, ...force, ...calcTilt(t), ...zero, ...reference, ...rotors];
    values.forEach((value, index) => bytes.writeFloatLE(value, 24 + 8 * rows + 4 * (i * kColumns.length + index)));
  }
  return bytes;
}

/**
 * `page`: the HTML file to serve. `hasRun` false: no flight. `token`: needed to operate. The result's `control` has the
 * messages from pages, and `requests` the paths of HTTP requests.
 */
export async function startFakeServer({ page, vehicles = 1, hasRun = true, token = null, readOnly = false, port = 0 }) {
  const html = readFileSync(page);
  const control = [];
  const requests = [];
  const state = { phase: "running", step: 0, began: performance.now(), isFrozen: false };
  const http = createServer((request, response) => {
    requests.push(request.url);
    const isPage = request.url === "/";
    response.writeHead(isPage ? 200 : 404, { "content-type": "text/html; charset=utf-8" });
    response.end(isPage ? html : "");
  });
  const sockets = new WebSocketServer({ server: http, handleProtocols: (names) => (names.has("sls.view.1") ? "sls.view.1" : false) });
  const run = makeRun(vehicles);

  const advance = () => {
    const now = performance.now();
    if (state.phase === "running" && !state.isFrozen) state.step += Math.round((now - state.began) / 1000 / kPeriod);
    state.began = now;
  };
  const sendHello = (socket, isKnown) =>
    send(socket, { op: "hello", version: "test", domain: 140, vehicle_id: 0, may_operate: !readOnly && (!token || isKnown),
                   why_not: readOnly ? "started with --read-only" : token && !isKnown ? "expected a token" : "",
                   needs_token: Boolean(token) && !isKnown });
  const makeStatus = () => ({
    op: "status", run_id: kRunId, phase: state.phase, reason: "", step: state.step, sim_time_s: state.step * kPeriod,
    controller: "control_client", real_time_factor: 0.999, round_trip_p50_us: 162, round_trip_p99_us: 391,
    timing: `real-time, 2 of ${state.step} late, worst age 0 ms`, problem: "", counters: { late: 2, held: 2, resent: 0 },
    is_silent: false, silence_s: 0, waiting_for: "", stage: "figure_eight",
    participants: [
      { role: "controller", name: "control_client", host: "ground", vehicle_ids: run.vehicles.map(({ id }) => id), ready: true,
        done: false, last_complete_step: -1 },
      { role: "recorder", name: "recorder", host: "shelf", vehicle_ids: [], ready: true, done: false,
        last_complete_step: Math.max(0, state.step - 25) },
    ],
  });

  sockets.on("connection", (socket) => {
    let selected = 0;
    let sent = state.step;
    sendHello(socket, false);
    if (!hasRun) {
      send(socket, { op: "no_run", text: "No server has announced a run on domain 140.", command: "./sls run config/scenarios/figure_eight.yaml --view" });
      return;
    }
    send(socket, { op: "run", run });
    for (const [at, text] of [[0, "participants are ready"], [0.004, "run begins"], [1.2, "stage figure_eight begins"], [2.5, "fault: gust of 3 N begins"]])
      send(socket, { op: "event", run_id: kRunId, step: at / kPeriod, sim_time_s: at, text });
    send(socket, makeStatus());
    const poses = setInterval(() => {
      advance();
      if (socket.bufferedAmount > 1e6 || state.isFrozen) return;
      socket.send(packPoses(vehicles, state.step));
      const first = Math.max(sent, state.step - 256);
      if (state.step > first) socket.send(packRows(vehicles, selected, first, state.step));
      sent = state.step;
    }, kPoseTime);
    const status = setInterval(() => send(socket, makeStatus()), 100);
    socket.on("close", () => (clearInterval(poses), clearInterval(status)));
    socket.on("message", (data) => {
      const message = JSON.parse(String(data));
      control.push(message);
      if (message.op === "select") selected = message.vehicle_id;
      if (message.op === "authenticate") sendHello(socket, message.token === token);
      if (message.op !== "control") return;
      advance();
      const isRefused = message.action === "resume" && state.phase !== "paused";
      if (message.action === "pause") state.phase = "paused";
      if (message.action === "resume") state.phase = "running";
      if (message.action === "step") state.step += message.steps;
      if (message.action === "stop") state.phase = "failed";
      send(socket, { op: "reply", id: message.id, action: message.action, accepted: !isRefused, reason: isRefused ? "not paused" : "", step: state.step });
      send(socket, makeStatus());
    });
  });
  await new Promise((resolve) => http.listen(port, "127.0.0.1", resolve));
  return {
    url: `http://127.0.0.1:${http.address().port}/`, port: http.address().port, control, requests, state,
    /** Stops the flight at `step`: a test can compute the picture. */
    freeze(step) {
      advance();
      for (const socket of sockets.clients) socket.send(packPoses(vehicles, step));
      state.isFrozen = true;
    },
    stop() {
      for (const socket of sockets.clients) socket.terminate();
      http.closeAllConnections();
      return new Promise((resolve) => http.close(resolve));
    },
  };
}

function send(socket, message) {
  if (socket.readyState === 1) socket.send(JSON.stringify(message));
}
