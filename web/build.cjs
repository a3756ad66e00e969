"use strict";

// Makes the pages: node web/build.cjs FOLDER GRADE.wasm PLAYGROUND.wasm puts a program, scripts and styles into one file each.
const fs = require("node:fs");
const path = require("node:path");
const zlib = require("node:zlib");

const [folder, grade, playground] = process.argv.slice(2);
const root = path.join(__dirname, "..");
const read = (...parts) => fs.readFileSync(path.join(root, ...parts), "utf8");
const packed = (bytes) => zlib.gzipSync(bytes, { level: 9 }).toString("base64");

/* The scenes in XML: group and name, and their text. */
function scenes() {
  const found = {};
  for (const assets of ["assets", "extracreditassets"]) {
    for (const group of fs.readdirSync(path.join(root, assets)).sort()) {
      if (!/^[A-Z]/.test(group)) continue;
      for (const file of fs.readdirSync(path.join(root, assets, group)).sort()) {
        if (file.endsWith(".xml")) found[`${group}/${file.slice(0, -4)}`] = read(assets, group, file);
      }
    }
  }
  return JSON.stringify(found);
}

/* Where a part of a page is. */
function place(name) {
  const folders = ["web", "simulator/picture/src/web", "simulator/simulate/src/view"];
  return folders.map((each) => path.join(each, name)).find((file) => fs.existsSync(path.join(root, file)));
}

fs.mkdirSync(folder, { recursive: true });
for (const [name, program] of [["index.html", grade], ["playground.html", playground]]) {
  const parts = { program: () => packed(fs.readFileSync(program)), scenes: () => packed(scenes()) };
  const page = read("web", name).replace(/\{\{(.*?)\}\}/g, (_, part) => (parts[part] ?? (() => read(place(part))))());
  const target = path.join(folder, name);
  fs.writeFileSync(target, page);
  console.log(`${target}: ${(page.length / 1e6).toFixed(1)} MB, ${(zlib.gzipSync(page, { level: 9 }).length / 1e6).toFixed(2)} MB compressed`);
}
