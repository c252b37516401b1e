// Measures messages per second from a DDS publisher through sls_view to one client; prints one JSON
// line. Exit code 1 if a message was lost.
//   SLS_BUILD=build node tests/tools/view/foxglove/throughput.mjs [RATE [SECONDS]]
//   SLS_BUILD=build node tests/tools/view/foxglove/throughput.mjs fleet [VEHICLES [SECONDS]]
// The second subscribes to all mirrors of a fleet that flies 200 steps a second.
import { WebSocket } from "ws";
import { Client, startPublisher, startView, waitFor } from "./support.mjs";

const isFleet = process.argv[2] === "fleet";
const rate = Number(process.argv[2] ?? 50_000);
const vehicles = Number(process.argv[3] ?? 100);
const seconds = Number(process.argv[isFleet ? 4 : 3] ?? 10);
const kHeader = 13, kStep = kHeader + 4 + 8; // opcode, subscription, time; encapsulation, run_id

const ends = [];
const owner = { after: (end) => ends.unshift(end) };

/** Counts data messages of `channels`, and calls `judge` with each. */
function count(view, channels, judge) {
  const counted = { received: 0, dropped: 0, bytes: 0, first: 0, last: 0 };
  const ws = new WebSocket(view.url, ["foxglove.sdk.v1"], { perMessageDeflate: false });
  ws.on("open", () => ws.send(JSON.stringify({
    op: "subscribe", subscriptions: channels.map(({ id }) => ({ id, channelId: id })) })));
  ws.on("message", (data, isBinary) => {
    if (!isBinary) counted.dropped += Number(/"(\d+) messages dropped/.exec(data)?.[1] ?? 0);
    if (!isBinary || data[0] !== 1 || !counted.isOn) return;
    if (counted.received++ === 0) counted.first = performance.now();
    counted.last = performance.now();
    counted.bytes += data.length;
    judge?.(data);
  });
  owner.after(() => ws.terminate());
  return counted;
}

function describe({ received, dropped, bytes, first, last }) {
  const elapsed = (last - first) / 1000;
  return {
    received, dropped, seconds: Number(elapsed.toFixed(3)), per_s: Math.round(received / elapsed),
    megabytes_per_s: Number((bytes / elapsed / 1e6).toFixed(1)) };
}

const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/** Measures with samples whose steps are 0, 1, 2, … */
async function measureSamples(publisher, view, client) {
  let expected = 0n, gaps = 0;
  const counted = count(view, [await client.channel("sls/state")], (data) => {
    const step = data.readBigUInt64LE(kStep);
    if (step !== expected) gaps += 1;
    expected = step + 1n;
  });
  await client.subscribe("sls/status");
  publisher.say("rest");
  const rests = client.messages.get("sls/status")?.length ?? 0;
  await client.message("sls/status", rests + 5);
  counted.isOn = true;
  publisher.say(`burst ${rate} ${seconds}`);
  const { written } = JSON.parse(await waitFor("the burst", () => publisher.lines.shift()));
  let seen = -1;
  while (seen !== counted.received) {
    seen = counted.received;
    await pause(1000);
  }
  const lost = written - counted.received;
  return { measure: "foxglove_samples", wanted_per_s: rate, written, lost, gaps, ...describe(counted) };
}

async function measureFleet(publisher, view, client) {
  publisher.say("pace 5");
  publisher.say(`fleet ${vehicles}`);
  await client.channel(`/sls/vehicle_${vehicles - 1}/markers`);
  const mirrors = [...client.channels.values()].filter((one) => one.schemaEncoding === "ros2msg");
  const counted = count(view, mirrors);
  await pause(1000);
  counted.isOn = true;
  await pause(seconds * 1000);
  counted.isOn = false;
  return { measure: "foxglove_fleet", vehicles, channels: mirrors.length, lost: counted.dropped,
    ...describe(counted) };
}

async function measure() {
  const publisher = await startPublisher(owner, "publish");
  const view = await startView(owner, publisher.domain);
  const client = new Client(owner, view.url);
  return await (isFleet ? measureFleet : measureSamples)(publisher, view, client);
}

let result;
try {
  result = await measure();
} finally {
  for (const end of ends) await end();
}
console.log(JSON.stringify(result));
process.exit(result.lost === 0 ? 0 : 1);
