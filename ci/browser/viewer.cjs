"use strict";

// Checks of `simulate view` in a browser; check.cjs calls it.
const assert = require("node:assert/strict");
const { execFileSync, spawn } = require("node:child_process");
const fs = require("node:fs");
const http = require("node:http");
const path = require("node:path");
const readline = require("node:readline");
const comparePicture = require("./pictures.cjs");

// A running viewer: its address, and the origin of that.
async function start(simulate, args) {
  const child = spawn(simulate, ["view", ...args], { stdio: ["ignore", "pipe", "inherit"] });
  const lines = readline.createInterface({ input: child.stdout });
  const address = await new Promise((resolve, reject) => {
    lines.on("line", (line) => /http:\S+/.test(line) && resolve(/http:\S+/.exec(line)[0]));
    child.on("exit", (code) => reject(new Error(`simulate view ended with ${code}`)));
  });
  const ended = new Promise((resolve) => child.on("exit", (code, signal) => resolve(signal)));
  return { address, origin: new URL(address).origin, end: () => (child.kill("SIGINT"), ended) };
}

// Keys that are pressed in a field are typed into it.
async function press(page, key) {
  await page.locator(".pane canvas").first().focus();
  await page.keyboard.press(key);
}

const settled = (page) => page.waitForFunction(() => {
  const { waiting, changed, fresh, panes } = Report.live;
  return !waiting && !changed && !fresh && !panes.some((pane) => pane.state?.underway);
});
const step = (page, run = 0) => page.locator(".pane canvas").nth(run).getAttribute("data-step").then(Number);
const energy = (page, run = 0) => page.evaluate((run) => {
  const { kinetic, potential } = Report.live.panes[run].state;
  return kinetic === null || potential === null ? Infinity : kinetic + potential;
}, run);

// Explicit Euler blows up; implicit Euler holds.
async function blowUp(page) {
  await page.locator("select[aria-label=Speed]").selectOption("10");
  await press(page, "k");
  const verdict = page.locator(".pane .verdict");
  await verdict.waitFor({ state: "visible", timeout: 60_000 });
  assert.match(await verdict.textContent(), /^Blew up at t = [\d.]+ s, after step \d+: the kinetic energy is [\d.e]+ J/);
  const stopped = await step(page);
  await page.waitForTimeout(200);
  assert.equal(await step(page), stopped, "a run that blew up stands still");
  const count = await page.evaluate(() => Report.live.panes[0].positions.every(Number.isFinite));
  assert.equal(count, true, "the last finite state is shown");

  await page.locator("select[name=integrator]").selectOption("implicit-euler");
  await press(page, "r");
  await verdict.waitFor({ state: "hidden" });
  await page.waitForFunction(() => Number(document.querySelector(".pane canvas").dataset.step) > 20);
  assert.ok(Math.abs(await energy(page)) < 1e5, "implicit Euler holds");
  await press(page, "k");
  await settled(page);
}

async function controls(page) {
  await press(page, "r");
  await settled(page);
  assert.equal(await step(page), 0);
  await press(page, ".");
  await page.waitForFunction(() => document.querySelector(".pane canvas").dataset.step === "1");
  const picture = () => page.locator(".pane canvas").first().screenshot();
  const before = await picture();
  for (const key of ["e", "m"]) {
    await press(page, key);
    assert.notDeepEqual(await picture(), before, `${key} hides something`);
    await press(page, key);
    assert.deepEqual(await picture(), before, `${key} shows it again`);
  }
  // Wind, mass, stiffness and damping change the next step; without a change it is the same.
  const positionsAfterAStep = async (change) => {
    await press(page, "r");
    await settled(page);
    await change();
    await settled(page);
    await press(page, ".");
    await page.waitForFunction(() => document.querySelector(".pane canvas").dataset.step === "1");
    return page.evaluate(() => [...Report.live.panes[0].positions].join());
  };
  const plain = await positionsAfterAStep(async () => {});
  assert.equal(await positionsAfterAStep(async () => {}), plain, "a run is deterministic");
  const fill = (name, value) => async () => {
    await page.locator(`input[name=${name}]`).fill(value);
    await page.locator(`input[name=${name}]`).press("Enter");
  };
  assert.notEqual(await positionsAfterAStep(() => press(page, "w")), plain, "wind");
  assert.equal(await positionsAfterAStep(() => press(page, "w")), plain, "no wind");
  assert.notEqual(await positionsAfterAStep(fill("timeStep", "0.008")), plain, "time step");
  assert.equal(await positionsAfterAStep(fill("timeStep", "0.004")), plain);
  assert.notEqual(await positionsAfterAStep(fill("mass", "3")), plain, "mass");
  assert.equal(await positionsAfterAStep(fill("mass", "1")), plain);
  assert.notEqual(await positionsAfterAStep(async () => {
    await fill("stiffness", "0.01")();
    await fill("damping", "5")();
  }), plain, "stiffness and damping");
  await fill("timeStep", "-1")();
  assert.match(await page.locator(".pane .refused").textContent(), /^h must be a number, 0 or more/, "an impossible h is refused");
  await fill("timeStep", "0")();
  await page.locator(".pane .verdict").waitFor();
  assert.match(await page.locator(".pane .verdict").textContent(), /^Cannot run: the time step is 0 s/);
  await fill("timeStep", "0.004")();
  await fill("stiffness", "1")();
  await fill("damping", "0")();
  await page.locator(".pane .verdict").waitFor({ state: "hidden" });
}

// A particle follows the pointer, and moves on when it is let go.
async function drag(page) {
  await press(page, "r");
  await settled(page);
  const place = (particle) => page.evaluate((particle) => {
    const { stage, canvas } = Report.live.panes[0];
    const box = canvas.getBoundingClientRect();
    return [box.left + stage.screen[4 * particle], box.top + stage.screen[4 * particle + 1]];
  }, particle);
  const [x, y] = await place(await page.evaluate(() => Math.floor(Report.live.data.scene.count / 2)));
  await page.mouse.move(x, y);
  await page.mouse.down();
  const held = await page.evaluate(() => Report.live.held.particle);
  await press(page, "k");
  await page.mouse.move(x - 60, y + 30, { steps: 5 });
  await page.waitForTimeout(300);
  const [heldX, heldY] = await place(held);
  const apart = Math.hypot(heldX - x + 60, heldY - y - 30);
  assert.ok(apart < 1, `the held particle is ${apart} pixels from the pointer`);
  const at = () => page.evaluate((particle) => [...Report.live.panes[0].stage.point(Report.live.panes[0].positions, particle)].join(), held);
  const before = await at();
  await page.mouse.up();
  await page.waitForTimeout(300);
  assert.notEqual(await at(), before, "a particle that is let go moves");
  await press(page, "k");
  await settled(page);
}

// Two integrators side by side, from the same state.
async function compare(page) {
  await press(page, "r");
  await settled(page);
  await press(page, "2");
  await page.waitForFunction(() => document.querySelectorAll(".pane").length === 2);
  await page.locator("select[name=integrator]").nth(1).selectOption("symplectic-euler");
  for (let count = 1; count <= 3; count++) {
    await press(page, ".");
    await page.waitForFunction((count) => [...document.querySelectorAll(".pane canvas")].every((each) => Number(each.dataset.step) === count), count);
  }
  const [first, second] = await page.evaluate(() => Report.live.panes.map((pane) => [...pane.positions].join()));
  assert.notEqual(first, second);
  assert.match(await page.locator(".charts .legend").textContent(), /total, implicit-euler \(run 1\).*total, symplectic-euler \(run 2\)/);
}

// A step without end: pause and reset do not wait for it.
async function endless(page) {
  await press(page, "k");
  const status = page.locator(".pane .status");
  await page.waitForFunction(() => /The next step has taken [1-9]/.test(document.querySelector(".pane .status").textContent));
  await press(page, "k");
  assert.equal(await page.evaluate(() => Report.live.playing), false);
  await press(page, "r");
  await settled(page);
  assert.match(await status.textContent(), /^Step 0, t = 0\ss\. Energy /);
}

// A sheet, stretched by 15 %, is coloured by three quarters of a scale to 20 %.
async function strained(page) {
  const picture = () => page.locator(".pane canvas").screenshot();
  await page.locator(".pane canvas").focus();
  const lines = await picture();
  await press(page, "s");
  await settled(page);
  const middle = await page.evaluate(() => {
    const { stage, canvas, positions } = Report.live.panes[0];
    const mean = [0, 1].map((axis) => positions.filter((_, place) => place % 2 === axis).reduce((sum, x) => sum + x / stage.count, 0));
    const at = [0, 0, 0, 0];
    stage.project(mean[0] + 0.05, mean[1] + 0.03, 0, at, 0);
    const ratio = canvas.width / stage.width;
    return [...canvas.getContext("2d").getImageData(at[0] * ratio, at[1] * ratio, 1, 1).data.slice(0, 3)];
  });
  assert.deepEqual(middle, [94, 201, 98]);
  assert.equal(await page.evaluate(() => Report.live.panes[0].stage.strain.full), 0.2);
  await press(page, "s");
  await settled(page);
  assert.deepEqual(await picture(), lines);
}

// A square of two materials is drawn by its faces, which cover its edges and particles, or without them.
async function faces(page) {
  const colors = () => page.evaluate(() => {
    const { stage, canvas } = Report.live.panes[0];
    const at = [0, 0, 0, 0];
    const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d", { willReadFrequently: true });
    copy.drawImage(canvas, 0, 0);
    return [-0.5, 0.5].map((x) => {
      stage.project(x, 0.4, 0, at, 0);
      const ratio = canvas.width / stage.width;
      return [...copy.getImageData(at[0] * ratio, at[1] * ratio, 1, 1).data.slice(0, 3)];
    });
  });
  const [red, blue] = await colors();
  assert.ok(red[0] > 100 && red[0] > 2 * red[2], `a red face: ${red}`);
  assert.ok(blue[2] > 100 && blue[2] > 2 * blue[0], `a blue face: ${blue}`);
  await press(page, "f");
  assert.deepEqual(await colors(), [[255, 255, 255], [255, 255, 255]], "without its faces");
  await press(page, "f");
  assert.deepEqual(await colors(), [red, blue]);
  await press(page, "ArrowRight");
  assert.notDeepEqual(await colors(), [red, blue], "the light stays where it is");
}

// Pages of other sites, and the same machine under another name.
async function strangers(browser, viewer) {
  const foreign = await new Promise((resolve) => {
    const server = http.createServer((request, response) => {
      response.writeHead(200, { "Content-Type": "text/html" });
      response.end("<!DOCTYPE html><title>foreign</title>");
    });
    server.listen(0, "127.0.0.1", () => resolve(server));
  });
  const page = await (await browser.newContext()).newPage();
  await page.goto(`http://127.0.0.1:${foreign.address().port}/`);
  const tries = await page.evaluate(async (address) => {
    const outcome = async (what) => {
      try {
        const response = await what();
        return response.type === "opaque" ? "opaque" : `${response.status}`;
      } catch {
        return "blocked";
      }
    };
    const loaded = (tag, attribute) => new Promise((resolve) => {
      const element = document.createElement(tag);
      element[attribute] = `${address}base.js`;
      element.onload = () => resolve("loaded");
      element.onerror = () => resolve("blocked");
      document.head.append(element);
    });
    return {
      read: await outcome(() => fetch(address)),
      post: await outcome(() => fetch(`${address}open`, { method: "POST" })),
      json: await outcome(() => fetch(`${address}open`, { method: "POST", headers: { "Content-Type": "application/json" } })),
      script: await loaded("script", "src"),
    };
  }, viewer.address);
  assert.deepEqual(tries, { read: "blocked", post: "blocked", json: "blocked", script: "blocked" });
  const named = await page.goto(viewer.address.replace("127.0.0.1", "localhost"));
  assert.equal(named.status(), 403, "another name of this machine");
  const plain = await page.goto(`${viewer.origin}/`);
  assert.equal(plain.status(), 403, "no token");
  await page.context().close();
  foreign.close();
}

module.exports = async function checkViewer({ browser, work, simulate, open, looksRight }) {
  const scene = (name, ...args) => {
    const file = path.join(work, name);
    execFileSync(simulate, ["generate", ...args, "-o", file]);
    return file;
  };
  const net = scene("net.xml", "net", "-n", "8", "--pin", "--integrator", "explicit-euler", "--dt", "0.004");
  let viewer = await start(simulate, [net]);
  for (const [look, options] of [["-dark", { colorScheme: "dark" }], ["-narrow", { viewport: { width: 390, height: 800 } }]]) {
    const { page, faults, close } = await open(browser, viewer.address, viewer.origin, options);
    await page.locator(".pane canvas").waitFor();
    await looksRight(page, `view${look}`);
    assert.deepEqual(faults, [], look);
    await close();
  }
  // The heading is the path of the scene.
  await comparePicture(browser, "view", viewer.address, "h1");
  const { page, faults, close } = await open(browser, viewer.address, viewer.origin);
  await page.locator(".pane canvas").waitFor();
  await blowUp(page);
  await controls(page);
  await drag(page);
  await compare(page);
  await looksRight(page, "view-two");
  await page.locator("select[name=integrator]").first().selectOption("explicit-euler");
  await page.locator("select[aria-label=Speed]").selectOption("2");
  await press(page, "k");
  await page.locator(".pane .verdict").first().waitFor({ state: "visible", timeout: 60_000 });
  await looksRight(page, "view-blown-up");
  await press(page, "k");
  await settled(page);
  await strangers(browser, viewer);
  await press(page, ".");
  await page.waitForTimeout(200);
  assert.equal(await page.locator("#ended").isVisible(), false, "nobody else changed the run");
  assert.deepEqual(faults, []);

  assert.equal(await viewer.end(), "SIGINT");
  await press(page, ".");
  await page.locator("#ended").waitFor();
  assert.match(await page.locator("#ended").textContent(), /^simulate has ended/);
  await close();

  // In 3D: turned, and dragged in the plane of the screen.
  viewer = await start(simulate, [scene("cloth.xml", "cloth", "--nx", "10", "--ny", "10")]);
  const solid = await open(browser, viewer.address, viewer.origin);
  await solid.page.locator(".pane canvas").waitFor();
  const flat = await solid.page.locator(".pane canvas").screenshot();
  for (const key of ["ArrowRight", "ArrowRight", "ArrowUp"]) await press(solid.page, key);
  assert.notDeepEqual(await solid.page.locator(".pane canvas").screenshot(), flat, "the scene turns");
  await drag(solid.page);
  await looksRight(solid.page, "view-3d");
  assert.deepEqual(solid.faults, []);
  await solid.close();
  await viewer.end();

  const mesh = path.join(work, "mesh.json");
  fs.writeFileSync(mesh, '{"obj": "mesh.obj", "k": 100, "m": 1, "b": [1, 4]}');
  fs.writeFileSync(path.join(work, "mesh.mtl"), "newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 0 1\n");
  const vertices = [-1, 0, 1].map((x) => `v ${x} -1 0\nv ${x} 1 0\n`).join("");
  fs.writeFileSync(path.join(work, "mesh.obj"), `mtllib mesh.mtl\n${vertices}usemtl a\nf 1 3 4 2\nusemtl b\nf 3 5 6 4\n`);
  viewer = await start(simulate, [mesh]);
  const covered = await open(browser, viewer.address, viewer.origin);
  await covered.page.locator(".pane canvas").waitFor();
  await settled(covered.page);
  await faces(covered.page);
  await looksRight(covered.page, "view-faces");
  assert.deepEqual(covered.faults, []);
  await covered.close();
  await viewer.end();

  viewer = await start(simulate, [scene("sheet.xml", "sheet", "--nx", "4", "--ny", "2", "--stretch", "1.15")]);
  const stretched = await open(browser, viewer.address, viewer.origin);
  await stretched.page.locator(".pane canvas").waitFor();
  await settled(stretched.page);
  await strained(stretched.page);
  assert.deepEqual(stretched.faults, []);
  await stretched.close();
  await viewer.end();

  viewer = await start(simulate, [net, "--integrator", "fast-mass-spring", "--option", "iterations=1000000000000"]);
  const long = await open(browser, viewer.address, viewer.origin);
  await endless(long.page);
  await looksRight(long.page, "view-endless");
  assert.deepEqual(long.faults, []);
  await long.close();
  assert.equal(await viewer.end(), "SIGINT");

  // A thousand particles, and a scene that is too slow.
  const measure = async (file, ...args) => {
    const viewer = await start(simulate, [file, ...args]);
    const { page, faults, close } = await open(browser, viewer.address, viewer.origin);
    await page.locator("[data-action=play]").click();
    await page.waitForFunction(() => Number(document.querySelector(".pane canvas").dataset.step) > 2);
    await page.waitForTimeout(5000);
    const status = await page.locator(".pane .status").textContent();
    assert.deepEqual(faults, []);
    await close();
    await viewer.end();
    return status;
  };
  const thousand = scene("thousand.xml", "net", "-n", "31", "--pin");
  const [quick, large] = [await measure(thousand, "--integrator", "symplectic-euler", "--dt", "0.001"), await measure(thousand)];
  assert.match(quick, /real time.* frames? a second/);
  const heavy = await measure(scene("heavy.xml", "net", "-n", "120", "--pin"), "--integrator", "implicit-euler");
  assert.match(heavy, /Too slow for real time: runs at \S+\s× real time, \S+ times slower than asked/);
  const words = (status) => status.replace(/^.*J\. /, "");
  console.log(`browser: simulate view, 1024 particles: symplectic Euler: ${words(quick)} linearized implicit Euler: ${words(large)}`);
  console.log(`browser: simulate view, 14641 particles, implicit Euler: ${words(heavy)}`);
};
