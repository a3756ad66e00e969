"use strict";

// Checks of the playground, opened as a file; ci/web.sh calls it with the path of Chromium.
const assert = require("node:assert/strict");
const { open: openPage, check } = require("./offline.cjs");
// Frames a second of a thousand particles, on a machine that does nothing else.
const QUICK = Number(process.env.WEB_FRAMES ?? 55);
const Completion = require("../../web/completion.js");

const SCENE = `<scene>
  <duration time="10"/>
  <integrator type="symplectic-euler" dt="0.01"/>
  <particle m="1" px="0" py="0" vx="0" vy="0" fixed="1"/>
  <particle m="1" px="1" py="0" vx="0" vy="0" fixed="0"/>
  <edge i="0" j="1"/>
  <springforce edge="0" k="10" l0="1"/>
  <simplegravity fx="0" fy="-9.8"/>
</scene>
`;

/* Particles in a row, each tied to the next one. */
function chain(count) {
  const numbers = [...Array(count).keys()];
  const particles = numbers.map((n) => `<particle m="1" px="${n / 10}" py="0" vx="0" vy="0" fixed="${n ? 0 : 1}"/>`);
  const springs = numbers.slice(1).map((n) => `<edge i="${n - 1}" j="${n}"/><springforce edge="${n - 1}" k="1000" l0="0.1"/>`);
  return SCENE.replace(/ *<particle[^]*?l0="1"\/>/, [...particles, ...springs].join("\n"));
}

function completions() {
  const known = new Completion([SCENE, '<scene><integrator type="explicit-euler" dt="1"/></scene>']);
  const names = (text) => known.at(text, text.length)?.names ?? null;
  assert.deepEqual(names("<sp"), ["springforce"]);
  assert.deepEqual(names('<particle m="1" p'), ["px", "py"]);
  assert.deepEqual(names('<particle m="1" '), ["fixed", "px", "py", "vx", "vy"]);
  assert.deepEqual(names('<integrator type="'), ["explicit-euler", "symplectic-euler"]);
  assert.deepEqual(names('<integrator type="s'), ["symplectic-euler"]);
  for (const nothing of ["<scene>", "<!-- <sp", "text", '<particle m="', "<unknown ", "<sp \""]) assert.equal(names(nothing), null, nothing);
}

async function main(executable) {
  completions();
  const offline = await openPage(executable, "playground.html", { width: 1280, height: 900 });
  const { page, shot, address } = offline;
  const open = async (at) => {
    await page.goto("about:blank");
    await page.goto(at);
    await page.waitForSelector('html[data-state="ready"][data-scene="open"]', { state: "attached" });
  };
  const write = async (text, state = "open") => {
    await page.evaluate((words) => {
      delete document.documentElement.dataset.scene;
      const field = document.getElementById("text");
      field.value = words;
      field.dispatchEvent(new InputEvent("input", { bubbles: true }));
    }, text);
    await page.waitForSelector(`html[data-scene="${state}"]`, { state: "attached" });
  };
  const step = () => page.evaluate(() => Number(document.querySelector(".pane canvas").dataset.step));
  const reached = (least) => page.waitForFunction((n) => Number(document.querySelector(".pane canvas")?.dataset.step) >= n, least);

  // It runs what is typed, and goes on running while it is typed.
  await open(address);
  assert.ok((await page.$$("#scene option")).length > 200);
  await write(SCENE);
  await page.click("h1");
  await page.keyboard.press("k");
  await reached(30);
  await shot("runs");
  await write(SCENE.replace('k="10"', 'k="40"'));
  await reached(5);

  // Two integrators; energies of both.
  await page.click("input[name=second]");
  await page.waitForFunction(() => document.querySelectorAll(".pane").length === 2);
  await reached(40);
  await page.waitForSelector("text=total, implicit-euler");
  await shot("two");
  await page.click("input[name=second]");

  // A particle is dragged.
  await page.keyboard.press("k");
  const place = () => page.evaluate(() => {
    const [pane] = playground.running.panes;
    const box = pane.canvas.getBoundingClientRect();
    const { screen } = pane.stage;
    return { x: box.left + screen[4], y: box.top + screen[5], at: [...pane.positions] };
  });
  await page.keyboard.press("r");
  await page.waitForFunction(() => playground.running.panes[0].positions[2] === 1);
  await page.evaluate(() => document.querySelector(".pane canvas").scrollIntoView());
  const before = await place();
  await page.mouse.move(before.x, before.y);
  await page.mouse.down();
  await page.mouse.move(before.x + 40, before.y - 20, { steps: 4 });
  await page.waitForTimeout(300);
  const after = await place();
  await shot("held");
  await page.mouse.up();
  assert.ok(Math.abs(after.at[2] - before.at[2]) > 1e-3, `${before.at} ${after.at}`);

  // An error names its line; the scene before it stays.
  await write(SCENE.replace('m="1" px="1"', 'm="-1" px="1"'), "refused");
  const words = await page.textContent("#problem");
  assert.match(words, /^Line 5, column \d+: /);
  assert.equal(await page.textContent("#lines .wrong"), "5");
  assert.ok(await page.$(".pane canvas"));
  await shot("error");
  for (const text of ["", "<", "<scene>", "text", "<scene/>", "\u0000", "<scene>" + "<a>".repeat(5000)]) await write(text, "refused");
  await write(SCENE.replace("<simplegravity", "<unknown/><simplegravity"));
  assert.match(await page.textContent("#problem"), /unknown/);

  // Completion by the keyboard.
  await write(SCENE);
  await page.focus("#text");
  await page.evaluate(() => {
    const text = document.getElementById("text");
    text.setSelectionRange(text.value.indexOf("  <simplegravity"), text.value.indexOf("  <simplegravity"));
  });
  await page.keyboard.type("<drag");
  await page.keyboard.press("Control+Enter");
  await page.keyboard.type("b");
  await page.keyboard.press("Control+Enter");
  assert.match(await page.inputValue("#text"), /<dragdamping b( |=)/);

  // An address holds the scene.
  const mine = SCENE.replace("</scene>", "<!-- µ + / = -->\n</scene>");
  await write(mine);
  await page.click("#share");
  await page.waitForFunction(() => location.hash.startsWith("#scene="));
  const shared = page.url();
  await open(shared);
  assert.equal(await page.inputValue("#text"), mine);
  await page.goto(`${address}#scene=damaged`);
  await page.waitForFunction(() => /damaged/.test(document.getElementById("problem").textContent));

  // A step without an end is given up.
  await open(address);
  await write(SCENE.replace('type="symplectic-euler"', 'type="fast-mass-spring" iterations="1000000000000"'));
  await page.click("h1");
  await page.keyboard.press("k");
  await page.waitForFunction(() => /given up/.test(document.getElementById("problem").textContent), null, { timeout: 60_000 });
  await write(SCENE);
  await page.waitForSelector(".pane canvas");

  // A thousand particles.
  await write(chain(1000));
  await page.click("h1");
  await page.keyboard.press("k");
  await page.waitForTimeout(4000);
  const rate = await page.evaluate(() => Number(document.querySelector(".pane canvas").dataset.fps));
  const taken = await step();
  assert.ok(taken > 0);
  assert.ok(rate >= QUICK, `1000 particles: ${rate} frames a second`);

  await write(SCENE);
  await offline.close();
  console.log(`playground: passed; 1000 particles: ${rate} frames a second`);
}

check(main);
