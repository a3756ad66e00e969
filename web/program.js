"use strict";

/* The program in this page, and its worker. */
const Program = {
  /* Decodes and compiles the program, and starts a worker with it; `hear` takes its messages, `fail` its faults. */
  async start(hear, fail) {
    if (!Program.module) {
      const digits = document.getElementById("program").textContent;
      const packed = Uint8Array.from(atob(digits), (digit) => digit.charCodeAt(0));
      Program.module = await WebAssembly.compile(await Program.unpack(packed, "gzip").then((all) => all.arrayBuffer()));
    }
    const source = new Blob([document.getElementById("worker-source").textContent], { type: "text/javascript" });
    const address = URL.createObjectURL(source);
    const worker = new Worker(address);
    URL.revokeObjectURL(address);
    worker.addEventListener("message", ({ data }) => hear(data));
    worker.addEventListener("error", (event) => fail(event.message));
    worker.postMessage({ module: Program.module });
    return worker;
  },

  /* Compressed bytes as a response. */
  async unpack(bytes, format) {
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream(format)));
  },
};
