"use strict";

// Checks of the page that grades in a browser, opened as a file; ci/web.sh calls it with the path of Chromium.
const assert = require("node:assert/strict");
const { execFileSync } = require("node:child_process");
const fs = require("node:fs");
const path = require("node:path");
const { root, work, open, check } = require("./offline.cjs");

const SCENE = "SpringDamping/shearing-triangle-linearized";
// Seconds from the drop to the verdict, on a machine that does nothing else.
const SOON = Number(process.env.WEB_SECONDS ?? 2);

/* The oracle's traces, and the same with one wrong number. */
function submissions() {
  fs.rmSync(work, { recursive: true, force: true });
  const copy = (name) => {
    const folder = path.join(work, name);
    fs.cpSync(path.join(root, "expected"), folder, { recursive: true, filter: (file) => !file.endsWith(".toml") });
    return folder;
  };
  const [right, wrong] = ["right", "wrong"].map(copy);
  const file = path.join(wrong, `${SCENE}.csv`);
  const lines = fs.readFileSync(file, "utf8").split("\n");
  const numbers = lines[18].split(",");
  numbers[6] = String(Number(numbers[6]) + 1e-6);
  lines[18] = numbers.join(",");
  fs.writeFileSync(file, lines.join("\n"));
  const zip = path.join(work, "right.zip");
  execFileSync("python3", ["-m", "zipfile", "-c", zip, ...fs.readdirSync(right)], { cwd: right });
  fs.writeFileSync(path.join(work, "notes.txt"), "no trace\n");
  fs.writeFileSync(path.join(work, "cut.csv"), "step,time\n");
  fs.writeFileSync(path.join(work, "hostile.zip"), "PK\x03\x04 broken <img src=x onerror=alert(1)>");
  return { right, wrong, zip, single: file };
}

async function main(executable) {
  const { right, wrong, zip, single } = submissions();
  const offline = await open(executable, "index.html", { width: 1200, height: 1000 });
  const { page, shot } = offline;
  const began = Date.now();
  await page.goto(offline.address);
  const reached = (state, time = 60_000) => page.waitForSelector(`html[data-state="${state}"]`, { state: "attached", timeout: time });
  await reached("ready");
  console.log(`web: ready after ${((Date.now() - began) / 1000).toFixed(1)} s`);
  const times = {};
  const seconds = () => page.evaluate(() => Number(document.documentElement.dataset.seconds));
  const choose = async (input, files, state) => {
    await page.evaluate(() => { document.documentElement.dataset.state = "asked"; });
    await page.setInputFiles(`#${input}`, files);
    await reached(state);
  };

  // Play: all of the suite, then an assignment.
  await choose("folder", right, "passed");
  times.all = await seconds();
  await page.evaluate(() => { document.documentElement.dataset.state = "asked"; });
  await page.selectOption("#assignment", "t1m3");
  await reached("passed");
  times.t1m3 = await seconds();
  await shot("passed");
  await choose("files", zip, "passed");
  times.zip = await seconds();

  // A wrong trace: the report of the program, as text and as a page with motion.
  await choose("folder", wrong, "failed");
  times.wrong = await seconds();
  for (const [name, time] of Object.entries(times)) assert.ok(time < SOON, `${name}: ${time} s`);
  const text = await page.textContent("#text");
  assert.match(text, new RegExp(SCENE));
  const report = await (await page.$("#page")).contentFrame();
  await report.waitForSelector("h1");
  await shot("failed");
  await report.click(`a[href*="${SCENE.split("/")[1]}"]`);
  await page.waitForTimeout(500);
  const inner = await (await page.$("#page")).contentFrame();
  await inner.waitForSelector("canvas");
  await inner.click("canvas");
  await page.keyboard.press("k");
  await shot("scene");

  // One trace.
  await choose("files", single, "failed");
  assert.match(await page.textContent("#text"), new RegExp(SCENE.split("/")[1]));

  // Wrong files: each is refused in words; of an archive, these are in the report.
  for (const [name, words, state, place] of [
    ["notes.txt", /no submission|no trace/, "refused", "#refused"],
    ["cut.csv", /No scene has this name/, "refused", "#refused"],
    ["hostile.zip", /archive/, "failed", "#text"],
  ]) {
    await choose("files", path.join(work, name), state);
    assert.match(await page.textContent(place), words, name);
  }
  await shot("refused");

  // Drop, as the system does it: a zip, then a folder.
  const devtools = await page.context().newCDPSession(page);
  const { x, y } = await (await page.$("#drop")).boundingBox();
  for (const [dropped, state] of [[zip, "passed"], [wrong, "failed"]]) {
    await page.evaluate(() => { document.documentElement.dataset.state = "asked"; });
    const data = { items: [], files: [dropped], dragOperationsMask: 1 };
    for (const type of ["dragEnter", "dragOver", "drop"]) {
      await devtools.send("Input.dispatchDragEvent", { type, x: x + 5, y: y + 5, data });
    }
    await reached(state);
  }
  assert.match(await page.textContent("#text"), new RegExp(SCENE));

  // Keyboard.
  await page.focus("#assignment");
  await page.keyboard.press("Tab");
  assert.equal(await page.evaluate(() => document.activeElement.id), "choose-folder");
  await offline.close({ iframes: false });
  console.log(`web: passed; seconds from the files to the report: ${JSON.stringify(times)}`);
}

check(main);
