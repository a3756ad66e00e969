"use strict";

// Makes the page: node web/build.cjs GRADE.wasm INDEX.html puts the program, scripts and styles into one file.
const fs = require("node:fs");
const path = require("node:path");
const zlib = require("node:zlib");

const [program, target] = process.argv.slice(2);
const read = (...parts) => fs.readFileSync(path.join(__dirname, ...parts), "utf8");
const parts = {
  "report.css": () => read("../simulator/picture/src/web/report.css"),
  grade: () => zlib.gzipSync(fs.readFileSync(program), { level: 9 }).toString("base64"),
};
const page = read("index.html").replace(/\{\{(.*?)\}\}/g, (_, name) => (parts[name] ?? (() => read(name)))());
fs.mkdirSync(path.dirname(target), { recursive: true });
fs.writeFileSync(target, page);
console.log(`${target}: ${(page.length / 1e6).toFixed(1)} MB, ${(zlib.gzipSync(page, { level: 9 }).length / 1e6).toFixed(2)} MB compressed`);
