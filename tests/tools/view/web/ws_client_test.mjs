// The server with the client of `ws` (npm) and fetch of Node. Usage: node ws_client_test.mjs ECHO_SERVER
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { once } from "node:events";
import { createInterface } from "node:readline";
import WebSocket from "ws";

const server = spawn(process.argv[2], { stdio: ["pipe", "pipe", "inherit"] });
const isOver = once(server, "exit");
const [line] = await once(createInterface(server.stdout), "line");
const host = `127.0.0.1:${line}`;

async function open(protocols, options = {}) {
  const socket = new WebSocket(`ws://${host}/`, protocols, options);
  await once(socket, "open");
  return socket;
}

async function findRefusal(protocols, options = {}) {
  const socket = new WebSocket(`ws://${host}/`, protocols, options);
  const [, answer] = await once(socket, "unexpected-response");
  answer.destroy();
  return answer.statusCode;
}

// The subprotocol is the first in the server's list that the client offers, too.
const socket = await open(["unknown", "echo.1", "echo.2"]);
assert.equal(socket.protocol, "echo.2");
assert.equal(await findRefusal(["unknown"]), 400);
assert.equal(await findRefusal(["echo.1"], { origin: "http://evil.com" }), 403);
assert.equal(await findRefusal(["echo.1"], { headers: { Host: "evil.com" } }), 403);

// Messages come back unchanged and in order.
const sent = [];
for (let i = 0; i < 3000; ++i) {
  sent.push(i % 2 === 0 ? `grün ${i}` : Buffer.alloc((i * 37) % 65536, i));
}
const received = [];
const isComplete = new Promise((resolve) => {
  socket.on("message", (data, isBinary) => {
    received.push(isBinary ? data : data.toString());
    if (received.length === sent.length) resolve();
  });
});
for (const [i, message] of sent.entries()) {
  socket.send(message);
  // More than 8 MiB in the send queue would close the connection.
  while (i - received.length > 50) await new Promise(setImmediate);
}
await isComplete;
assert.deepEqual(received, sent);

socket.ping("are you there");
assert.equal((await once(socket, "pong"))[0].toString(), "are you there");

// A message that is too long closes the connection with code 1009.
socket.send(Buffer.alloc(65537));
assert.equal((await once(socket, "close"))[0], 1009);

// HTTP.
assert.equal((await fetch(`http://${host}/recording/0`)).headers.get("cache-control"), "no-store");
assert.equal((await (await fetch(`http://${host}/recording/0`)).text()).length, 3_000_000);
assert.equal((await fetch(`http://${host}/%2e%2e/etc/passwd`)).status, 404);
assert.equal((await fetch(`http://${host}/recording/0`, { method: "POST", body: "x" })).status, 413);

// The server announces its end with code 1001.
const last = await open(["other"]);
server.stdin.end();
assert.equal((await once(last, "close"))[0], 1001);
assert.equal((await isOver)[0], 0);
