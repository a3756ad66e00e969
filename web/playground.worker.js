"use strict";

/* Runs the simulator in a separate thread.
 *
 * page ── { module } ─────────────────────> { ready }
 *      ── { number, open: text of a scene }   ──> { number, bytes } or { number, error }
 *      ── { number, frame: request of a frame } ──> the same */

let simulator = null;
let said = "";

function start(module) {
  const error = (bytes) => { said += new TextDecoder().decode(bytes); };
  const run = new Wasi.Run(new Wasi.Files(), { args: ["playground"], error });
  simulator = run.instantiate(module);
  simulator._initialize?.();
}

function ask(call, text) {
  const request = new TextEncoder().encode(text);
  const room = (length) => {
    // Memory may grow, and its buffer be another one then.
    const place = simulator.room(length);
    return new Uint8Array(simulator.memory.buffer, place, length);
  };
  room(request.length).set(request);
  const length = call();
  const bytes = room(Math.abs(length)).slice();
  return length < 0 ? { error: new TextDecoder().decode(bytes) } : { bytes: bytes.buffer };
}

onmessage = ({ data }) => {
  if (data.module) {
    start(data.module);
    postMessage({ ready: true });
    return;
  }
  let answer;
  try {
    answer = data.open === undefined ? ask(simulator.frame, JSON.stringify(data.frame)) : ask(simulator.open_scene, data.open);
  } catch (error) {
    answer = { fault: said.trim() || error.message };
  }
  postMessage({ number: data.number, ...answer }, answer.bytes ? [answer.bytes] : []);
};
