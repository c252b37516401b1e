// All topics, fields, services and frames that config/foxglove/sls.json shows exist.
import assert from "node:assert/strict";
import { parseIDL } from "@foxglove/omgidl-parser";
import { parse as parseRos } from "@foxglove/rosmsg";
import { readFileSync } from "node:fs";
import path from "node:path";
import { test } from "node:test";
import { Client, makeReader, root, startPublisher, startView } from "./support.mjs";

const layout = JSON.parse(readFileSync(path.join(root, "config/foxglove/sls.json"), "utf8"));

/** Message paths of all panels: "topic.field[0]{filter==0}.field". */
function listPaths() {
  const paths = [];
  for (const config of Object.values(layout.configById)) {
    for (const { value } of config.paths ?? []) paths.push(value);
    if (config.topicPath) paths.push(config.topicPath);
    if (config.path) paths.push(config.path);
    paths.push(...Object.keys(config.topics ?? {}));
  }
  return paths;
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
  const { domain } = await startPublisher(t, "publish");
  const view = await startView(t, domain);
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
  const message = await client.message("/tf");
  const { transforms } = makeReader(client.channels.get("/tf"))(message.data);
  const scene = layout.configById["3D!sls"];
  assert.ok(transforms.some((transform) => transform.child_frame_id === scene.followTf));
});

test("the layout shows every panel that it configures", () => {
  const shown = [];
  const collect = (node) =>
    typeof node === "string" ? shown.push(node) : (collect(node.first), collect(node.second));
  collect(layout.layout);
  assert.deepEqual(shown.sort(), Object.keys(layout.configById).sort());
});
