// A client of the Foxglove protocol made with Foxglove's own code.
import { parseIDL } from "@foxglove/omgidl-parser";
import { MessageReader as IdlReader } from "@foxglove/omgidl-serialization";
import { parse as parseRos } from "@foxglove/rosmsg";
import { MessageReader as RosReader } from "@foxglove/rosmsg2-serialization";
import wsProtocol from "@foxglove/ws-protocol";
import { WebSocket } from "ws";
import { waitFor } from "../page/browser.mjs";

/** A client that keeps all messages. */
export class Client {
  constructor(test, url, protocol = "foxglove.websocket.v1", options = {}) {
    this.serverInfos = [];
    this.channels = new Map(); // by topic
    this.services = new Map(); // by name
    this.messages = new Map(); // by topic
    this.responses = [];
    this.failures = [];
    this.errors = [];
    this.topics = new Map(); // by subscription
    this.ws = new WebSocket(url.replace("http", "ws"), [protocol], options);
    this.client = new wsProtocol.FoxgloveClient({ ws: this.ws });
    this.client.on("serverInfo", (info) => this.serverInfos.push(info));
    this.client.on("advertise", (channels) =>
      channels.forEach((channel) => this.channels.set(channel.topic, channel)));
    this.client.on("advertiseServices", (services) =>
      services.forEach((service) => this.services.set(service.name, service)));
    this.client.on("message", (message) => this.keep(message));
    this.client.on("serviceCallResponse", (response) => this.responses.push(response));
    this.client.on("serviceCallFailure", (failure) => this.failures.push(failure));
    this.client.on("error", (error) => this.errors.push(error));
    test.after(() => this.ws.terminate());
  }
  keep({ subscriptionId, timestamp, data }) {
    const topic = this.topics.get(subscriptionId);
    if (topic === undefined) throw new Error(`message of subscription ${subscriptionId}`);
    // No copy: the library gives each message its own buffer.
    this.messages.get(topic).push({ timestamp, data });
  }
  async channel(topic) {
    return await waitFor(`channel ${topic}`, () => this.channels.get(topic));
  }
  async subscribe(topic) {
    const channel = await this.channel(topic);
    this.messages.set(topic, []);
    this.topics.set(this.client.subscribe(channel.id), topic);
  }
  /** Decodes the messages of `topic` with Foxglove's libraries, once there are `count`. */
  async read(topic, count = 1) {
    const { schemaName, schemaEncoding, schema } = await this.channel(topic);
    const reader =
      schemaEncoding === "omgidl"
        ? new IdlReader(schemaName, parseIDL(schema))
        : new RosReader(parseRos(schema, { ros2: true }));
    const messages = this.messages.get(topic);
    await waitFor(`${count} messages of ${topic}`, () => messages.length >= count);
    return messages.map(({ timestamp, data }) => ({ timestamp, value: reader.readMessage(data) }));
  }
  /** Waits until the last message of `topic` meets `condition`; returns that message. */
  async until(topic, condition) {
    return await waitFor(`${condition}`, async () => {
      const { value } = (await this.read(topic)).at(-1);
      return condition(value) && value;
    });
  }
  /** Calls a service; returns its response, or throws its failure. */
  async call(name, request = {}) {
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
