// Shared by the tests of the Foxglove protocol: processes, and a client made with Foxglove's own code.
import { parseIDL } from "@foxglove/omgidl-parser";
import { MessageReader as IdlReader } from "@foxglove/omgidl-serialization";
import { parse as parseRos } from "@foxglove/rosmsg";
import { MessageReader as RosReader } from "@foxglove/rosmsg2-serialization";
import wsProtocol from "@foxglove/ws-protocol";
import { spawn } from "node:child_process";
import { once } from "node:events";
import path from "node:path";
import readline from "node:readline";
import { fileURLToPath } from "node:url";
import { WebSocket } from "ws";

export const { FoxgloveClient } = wsProtocol;
export const root = path.resolve(path.dirname(fileURLToPath(import.meta.url)), "../../../..");
const build = process.env.SLS_BUILD ?? path.join(root, "build");
const kPatience = 60_000; // long: a test must not fail on a busy machine

/** Waits until `find` returns another value than undefined or false. */
export async function waitFor(what, find, patience = kPatience) {
  const deadline = Date.now() + patience;
  for (;;) {
    const found = await find();
    if (found !== undefined && found !== false) return found;
    if (Date.now() > deadline) throw new Error(`waited in vain for ${what}${Program.describeAll()}`);
    await new Promise((resolve) => setTimeout(resolve, 10));
  }
}

/** A program that ends with the test; `lines` and `errors` collect its stdout and stderr. */
export class Program {
  static all = [];
  /** The last output of the running programs, for the message of a failure. */
  static describeAll() {
    return Program.all.map((one) => `\n${one.name}: ${one.errors.slice(-3).join(" | ")}`).join("");
  }

  constructor(test, program, args) {
    this.name = program;
    // The first one ends last: it holds the domain of the others.
    if (Program.all.length === 0)
      test.after(async () => {
        for (const one of [...Program.all].reverse()) await one.end();
      });
    Program.all.push(this);
    this.lines = [];
    this.errors = [];
    this.process = spawn(path.join(build, program), args, { stdio: ["pipe", "pipe", "pipe"] });
    this.process.on("error", (error) => this.errors.push(String(error)));
    readline.createInterface(this.process.stdout).on("line", (line) => this.lines.push(line));
    readline.createInterface(this.process.stderr).on("line", (line) => this.errors.push(line));
  }
  say(line) {
    this.process.stdin.write(`${line}\n`);
  }
  /** The first match of `pattern` in its stderr. */
  async find(pattern) {
    return await waitFor(`${pattern} in:\n${this.errors.join("\n")}`, () => {
      for (const line of this.errors) {
        const match = pattern.exec(line);
        if (match) return match;
      }
      return undefined;
    });
  }
  async end() {
    Program.all = Program.all.filter((one) => one !== this);
    if (this.process.exitCode !== null || this.process.signalCode !== null) return;
    this.process.stdin.end();
    this.process.kill("SIGTERM");
    const timer = setTimeout(() => this.process.kill("SIGKILL"), 20_000);
    await once(this.process, "exit");
    clearTimeout(timer);
  }
}

/** Starts publisher.cpp: it reserves a DDS domain and, with `mode` "publish", publishes a flight on it. */
export async function startPublisher(test, mode) {
  const publisher = new Program(test, "tests/view_foxglove_publisher", [mode]);
  const line = await waitFor("the publisher's domain", () => publisher.lines.shift());
  publisher.domain = JSON.parse(line).domain;
  return publisher;
}

/** sls_view on `domain`; its `url` is that of its WebSocket. */
export async function startView(test, domain, args = []) {
  const qos = path.join(root, "config/qos/udp.xml");
  const view = new Program(test, "bin/sls_view", [
    "--domain", String(domain), "--qos", qos, "--port", "0", ...args]);
  const [, page] = await view.find(/page: (http:\/\/\S+)/);
  view.url = page.replace("http", "ws");
  return view;
}

/** A client that keeps all messages. */
export class Client {
  constructor(test, url, protocol = "foxglove.websocket.v1", options = {}) {
    this.serverInfos = [];
    this.statuses = [];
    this.channels = new Map(); // by topic
    this.services = new Map(); // by name
    this.unadvertised = [];
    this.times = [];
    this.messages = new Map(); // by topic
    this.responses = [];
    this.failures = [];
    this.errors = [];
    this.topics = new Map(); // by subscription
    this.ws = new WebSocket(url, [protocol], options);
    this.client = new FoxgloveClient({ ws: this.ws });
    this.client.on("serverInfo", (info) => this.serverInfos.push(info));
    this.client.on("status", (status) => this.statuses.push(status));
    this.client.on("advertise", (channels) =>
      channels.forEach((channel) => this.channels.set(channel.topic, channel)));
    this.client.on("unadvertise", (ids) => this.unadvertise(ids));
    this.client.on("advertiseServices", (services) =>
      services.forEach((service) => this.services.set(service.name, service)));
    this.client.on("time", ({ timestamp }) => this.times.push(timestamp));
    this.client.on("message", (message) => this.keep(message));
    this.client.on("serviceCallResponse", (response) => this.responses.push(response));
    this.client.on("serviceCallFailure", (failure) => this.failures.push(failure));
    this.client.on("error", (error) => this.errors.push(error));
    this.client.on("close", (event) => (this.closed = event));
    test.after(() => this.ws.terminate());
  }
  unadvertise(ids) {
    for (const [topic, channel] of this.channels)
      if (ids.includes(channel.id)) {
        this.unadvertised.push(topic);
        this.channels.delete(topic);
      }
  }
  keep({ subscriptionId, timestamp, data }) {
    const topic = this.topics.get(subscriptionId);
    if (topic === undefined) throw new Error(`message of subscription ${subscriptionId}`);
    if (!this.messages.has(topic)) this.messages.set(topic, []);
    // No copy: the library gives each message its own buffer.
    this.messages.get(topic).push({ timestamp, data });
  }
  async channel(topic) {
    return await waitFor(`channel ${topic}`, () => this.channels.get(topic));
  }
  async subscribe(topic) {
    const channel = await this.channel(topic);
    const id = this.client.subscribe(channel.id);
    this.topics.set(id, topic);
    return id;
  }
  async message(topic, number = 0) {
    return await waitFor(`message ${number} of ${topic}`, () => this.messages.get(topic)?.[number]);
  }
  /** Calls a service; returns its response, or throws its failure. */
  async call(name, request) {
    const service = await waitFor(`service ${name}`, () => this.services.get(name));
    const callId = (this.calls = (this.calls ?? 0) + 1);
    const data = new TextEncoder().encode(JSON.stringify(request));
    this.client.sendServiceCallRequest({ serviceId: service.id, callId, encoding: "json", data });
    return await waitFor(`reply of ${name}`, () => {
      const failure = this.failures.find((one) => one.callId === callId);
      if (failure) throw new Error(failure.message);
      const response = this.responses.find((one) => one.callId === callId);
      return response && JSON.parse(new TextDecoder().decode(response.data));
    });
  }
}

/** Decodes messages of a channel with Foxglove's libraries. */
export function makeReader(channel) {
  const reader =
    channel.schemaEncoding === "omgidl"
      ? new IdlReader(channel.schemaName, parseIDL(channel.schema))
      : new RosReader(parseRos(channel.schema, { ros2: true }));
  return (data) => reader.readMessage(data);
}
