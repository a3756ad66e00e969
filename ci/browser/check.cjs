"use strict";

// Checks of the pages in a browser; ci/browser.sh calls it with the path of Chromium.
const assert = require("node:assert/strict");
const { execFileSync } = require("node:child_process");
const fs = require("node:fs");
const http = require("node:http");
const path = require("node:path");
const { pathToFileURL } = require("node:url");
const { chromium } = require("playwright-core");
const axe = require("axe-core");
const comparePicture = require("./pictures.cjs");
const checkViewer = require("./viewer.cjs");

const root = path.resolve(__dirname, "../..");
const work = path.join(root, "target/browser/pages");
const screenshots = path.join(root, "target/browser/screenshots");
const SCENE = "SpringDamping/shearing-triangle-linearized";
const EXPLODES = "FixedParticles/strongly-damped-spoke-linearized";

// Texts that a submission may print. None may run, and none may break the layout.
const HOSTILE = [
  "<script>document.title='run'</script>", "]]>", "</pre></div><script>alert(1)</script>",
  "<img src=x onerror=\"document.title='run'\">", "\u001b[31mred\u001b[0m\u001b]0;title\u0007", "\u001b[2J\u001b[H",
  "\"><svg onload=alert(1)>", "' onmouseover='alert(1)", "<!-- --><script>1</script>", "</script><script>alert(1)</script>",
  "\u202egnp.exe\u202c", "A".repeat(3000), "&lt;b&gt; &#60;", "<style>*{display:none}</style>",
  "<iframe src=http://example.com></iframe>", "javascript:alert(1)", "<a href=javascript:alert(1)>x</a>",
  "\u2028\u2029alert(1)", "{{7*7}} ${7*7} <%= 7 %>", "<meta http-equiv=refresh content=0;url=http://example.com>",
];

function grade(...args) {
  try {
    return execFileSync(path.join(root, "target/release/grade"), args, { cwd: root, encoding: "utf8", stdio: ["ignore", "pipe", "pipe"] });
  } catch (error) {
    // A submission that fails is what is looked at.
    assert.equal(error.status, 1, `${args.join(" ")}: ${error.stderr}`);
    return error.stdout;
  }
}

function write(name, text, mode) {
  const file = path.join(work, name);
  fs.mkdirSync(path.dirname(file), { recursive: true });
  fs.writeFileSync(file, text, { mode });
  return file;
}

// Submissions: traces with one wrong number, traces far off in 3D and ones that explode, and a program for each hostile text.
function submissions() {
  fs.rmSync(work, { recursive: true, force: true });
  const traces = path.join(work, "class/ada");
  fs.cpSync(path.join(root, "expected"), traces, { recursive: true, filter: (file) => !/\.toml$/.test(file) });
  const wrong = path.join(traces, `${SCENE}.csv`);
  const lines = fs.readFileSync(wrong, "utf8").split("\n");
  const numbers = lines[18].split(",");
  numbers[2 + 4 * 1] = String(Number(numbers[2 + 4 * 1]) + 1e-6);
  lines[18] = numbers.join(",");
  fs.writeFileSync(wrong, lines.join("\n"));
  const turned = path.join(traces, "FastMassSpring/small-flag.csv");
  const shifted = fs.readFileSync(turned, "utf8").split("\n").map((line, row) => {
    const fields = line.split(",");
    if (row < 10 || fields.length < 3) return line;
    for (let place = 2; place < fields.length; place += 6) fields[place] = String(Number(fields[place]) + 0.01 * (row - 9));
    return fields.join(",");
  });
  fs.writeFileSync(turned, shifted.join("\n"));
  const exploding = path.join(traces, `${EXPLODES}.csv`);
  const grown = fs.readFileSync(exploding, "utf8").split("\n").map((line, row) => {
    const fields = line.split(",");
    if (row < 3 || fields.length < 3) return line;
    return fields.map((field, place) => (place < 2 ? field : String(Number(field) * 10 ** (row - 2)))).join(",");
  });
  fs.writeFileSync(exploding, grown.join("\n"));
  HOSTILE.forEach((text, number) => {
    write(`class/hostile-${number}/text`, text);
    write(`class/hostile-${number}/run.sh`, 'cat "$(dirname "$0")/text"\ncat "$(dirname "$0")/text" >&2\nexit 3\n');
    write(`class/hostile-${number}/submission.toml`,
      `name = "hostile"\nrun = ["sh", "{folder}/run.sh", "{scene}", "{trace}"]\nformat = "csv"\n`);
  });
  return traces;
}

// A page that fails on console errors, dialogs and requests to anywhere but `origin`.
async function open(browser, url, origin, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 900 }, ...options });
  const page = await context.newPage();
  const faults = [];
  page.on("console", (message) => ["error", "warning"].includes(message.type()) && faults.push(message.text()));
  page.on("pageerror", (error) => faults.push(String(error)));
  page.on("dialog", (dialog) => {
    faults.push(`dialog: ${dialog.message()}`);
    dialog.dismiss();
  });
  page.on("request", (request) => {
    const address = request.url();
    if (!address.startsWith(origin) && !address.startsWith("data:")) faults.push(`request: ${address}`);
  });
  await page.goto(url);
  return { page, faults, close: () => context.close() };
}

async function looksRight(page, name) {
  const wide = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
  assert.ok(wide <= 0, `${name} is ${wide} pixels wider than the window`);
  await page.evaluate(axe.source);
  const found = await page.evaluate(() => axe.run(document, { resultTypes: ["violations"], preload: false }));
  const serious = found.violations.filter((each) => ["serious", "critical"].includes(each.impact));
  assert.deepEqual(serious.map((each) => `${each.id}: ${each.nodes.map((node) => node.target).join(" ")}`), [], name);
  await page.screenshot({ path: path.join(screenshots, `${name}.png`), fullPage: true });
}

const step = (page) => page.locator("canvas").first().getAttribute("data-step").then(Number);

async function playback(page, expected) {
  assert.equal(await step(page), expected, "the page opens at the first wrong step of the JSON report");
  const before = await page.locator("canvas").first().screenshot();
  assert.deepEqual(await page.locator("canvas").first().screenshot(), before, "the picture is deterministic");
  await page.keyboard.press(".");
  assert.equal(await step(page), expected + 1);
  assert.notDeepEqual(await page.locator("canvas").first().screenshot(), before, "a step changes the picture");
  await page.keyboard.press(",");
  await page.keyboard.press(",");
  assert.equal(await step(page), expected - 1);
  await page.locator("[data-action=last]").click();
  assert.equal(await step(page), 100);
  await page.locator("[data-action=first]").click();
  assert.equal(await step(page), 0);
  await page.keyboard.press("k");
  await page.waitForFunction(() => Number(document.querySelector("canvas").dataset.step) > 3);
  await page.keyboard.press("k");
  const stopped = await step(page);
  await page.waitForTimeout(200);
  assert.equal(await step(page), stopped, "a pause stops");
  await page.evaluate(() => document.activeElement.blur());
  await page.keyboard.press("Space");
  await page.waitForFunction((from) => Number(document.querySelector("canvas").dataset.step) > from, stopped);
  await page.keyboard.press("Space");
  assert.equal(await page.evaluate(() => Report.player.playing), false, "space plays and pauses");
  await page.locator("input[type=range]").fill("50");
  assert.equal(await step(page), 50);
  await page.keyboard.press("w");
  assert.equal(await step(page), expected);
  assert.match(await page.locator("#status").textContent(), new RegExp(`First wrong step: particle 1`));
  assert.match(await page.locator(".axis").textContent(), new RegExp(`step ${expected}`));
  assert.equal(await page.locator(".numbers mark").count() > 0, true, "the digits that differ are marked");
  // The canvas shows the submission, the oracle and the mark of the wrong particle.
  const colors = await page.evaluate(() => {
    const { data } = document.querySelector("canvas").getContext("2d").getImageData(0, 0, 5000, 5000);
    const seen = new Set();
    for (let i = 0; i < data.length; i += 4) seen.add(`${data[i]},${data[i + 1]},${data[i + 2]}`);
    return [...seen];
  });
  for (const color of ["10,90,160", "179,71,0", "179,38,30"]) assert.ok(colors.includes(color), `no pixel of ${color}`);
}

// Finding, equation and motion side by side, with the controls in view; forces on request.
async function sideBySide(browser, address, origin) {
  const { page, faults, close } = await open(browser, address, origin, { viewport: { width: 1280, height: 800 } });
  const box = (selector) => page.locator(selector).first().boundingBox();
  const [motion, finding, equation, controls] = await Promise.all([".motion", ".finding", ".equation", ".controls"].map(box));
  assert.ok(finding.x >= motion.x + motion.width && equation.x >= motion.x + motion.width, "beside the motion");
  assert.ok(equation.y < 800 && controls.y + controls.height <= 800, `in view: ${JSON.stringify([equation, controls])}`);
  const before = await page.locator("canvas").first().screenshot();
  await page.locator("input[name=forces]").check();
  assert.notDeepEqual(await page.locator("canvas").first().screenshot(), before, "forces are drawn");
  assert.match(await page.locator("#status").textContent(), /The longest arrow of a force is [\d.]+ N/);
  assert.deepEqual(faults, []);
  await close();
}

// Elements of elastic bodies are coloured on request, and a scale says how far.
async function strained(browser, address, origin) {
  const { page, faults, close } = await open(browser, address, origin);
  const canvas = page.locator("canvas").first();
  const before = await canvas.screenshot();
  await page.locator("input[name=strain]").check();
  assert.notDeepEqual(await canvas.screenshot(), before, "strain is drawn");
  assert.ok((await page.evaluate(() => Report.player.view.strain.full)) > 0);
  await page.locator("input[name=strain]").uncheck();
  assert.deepEqual(await canvas.screenshot(), before);
  assert.deepEqual(faults, []);
  await close();
}

// A run that explodes: its times are shown, and the oracle's energy is seen.
async function exploded(browser, address, origin) {
  const { page, faults, close } = await open(browser, address, origin);
  const energy = page.locator("#energy-charts figure").first();
  const ticks = await energy.locator(".drawing text").allTextContents();
  assert.ok(ticks.filter((tick) => tick === "0").length <= 2, `ticks of time: ${ticks}`);
  assert.ok(ticks.every((tick) => !/e\d\d/.test(tick)), `ticks of the energy: ${ticks}`);
  assert.match(await energy.locator(".legend").textContent(), /kinetic, submission, beyond the frame from t = /);
  assert.deepEqual(faults, []);
  await close();
}

// All pages in one file: its links, its scripts, and nothing that an edit adds.
async function oneFile(browser, file, expected) {
  const address = pathToFileURL(file).href;
  const { page, faults, close } = await open(browser, address, address);
  await page.locator("[data-filtered] tbody a", { hasText: SCENE }).click();
  await page.waitForFunction((title) => document.title === title && document.querySelector("canvas"), SCENE);
  assert.equal(await step(page), expected, "the page of the scene opens at its first wrong step");
  await page.locator(".top a").click();
  await page.locator("#features").waitFor();
  assert.deepEqual(faults, []);
  await close();
  fs.writeFileSync(file, fs.readFileSync(file, "utf8").replace("<body>", "<body><script>document.documentElement.dataset.ran = 1</script>"));
  const edited = await open(browser, address, address);
  assert.equal(await edited.page.evaluate(() => document.documentElement.dataset.ran), undefined, "other scripts do not run");
  await edited.close();
}

// A scene of the gallery: its picture, its playback, its slider.
async function playGallery(browser, address, origin) {
  const { page, faults, close } = await open(browser, address, origin);
  assert.equal(await page.locator(".card").count(), 3);
  assert.equal(await page.locator(".card canvas").count(), 2, "a file that is no scene has no picture");
  const card = page.locator(".card", { hasText: "garland_t1m2.xml" });
  const frame = () => card.locator("canvas").getAttribute("data-frame").then(Number);
  await card.locator("[data-action=play]:enabled").waitFor();
  // The colours of the scene: its background and its star.
  const colors = await card.locator("canvas").evaluate((canvas) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    const seen = new Set();
    for (let i = 0; i < data.length; i += 4) seen.add(`${data[i]},${data[i + 1]},${data[i + 2]}`);
    return [...seen];
  });
  for (const color of ["8,5,20", "255,237,179"]) assert.ok(colors.includes(color), `no pixel of ${color}`);
  await card.locator("input[type=range]").focus();
  await page.keyboard.press("Home");
  assert.equal(await frame(), 0);
  await card.locator("[data-action=play]").press("Enter");
  await page.waitForFunction((canvas) => Number(canvas.dataset.frame) > 3, await card.locator("canvas").elementHandle());
  await card.locator("[data-action=play]").press("Enter");
  const stopped = await frame();
  await page.waitForTimeout(200);
  assert.equal(await frame(), stopped, "a pause stops");
  assert.deepEqual(faults, []);
  await close();
}

// Frames a second while the picture plays.
async function framesPerSecond(page) {
  return page.evaluate(() => new Promise((resolve) => {
    Report.player.seek(0);
    document.querySelector("select[aria-label=Speed]").value = "0.05";
    Report.player.play();
    let frames = 0;
    let start = null;
    const count = (now) => {
      start ??= now;
      frames++;
      if (now - start < 2000) requestAnimationFrame(count);
      else resolve(Math.round((1000 * (frames - 1)) / (now - start)));
    };
    requestAnimationFrame(count);
  }));
}

function serve(folder) {
  const types = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css" };
  const server = http.createServer((request, response) => {
    const file = path.join(folder, decodeURIComponent(new URL(request.url, "http://localhost").pathname));
    fs.readFile(file, (error, bytes) => {
      response.writeHead(error ? 404 : 200, { "Content-Type": types[path.extname(file)] ?? "application/octet-stream" });
      response.end(error ? "" : bytes);
    });
  });
  return new Promise((resolve) => server.listen(0, "127.0.0.1", () => resolve(server)));
}

async function main() {
  const traces = submissions();
  fs.mkdirSync(screenshots, { recursive: true });
  const html = path.join(work, "one");
  // Pages name the folder as it was given.
  const report = JSON.parse(grade(path.relative(root, traces), "--html", html, "--format", "json"));
  const graded = report.features.flatMap((feature) => feature.scenes);
  const expected = graded.find((scene) => scene.name === SCENE).first_wrong;
  assert.deepEqual([expected.step, expected.particle], [17, 1]);
  const pages = path.join(work, "class-pages");
  const rubric = write("rubric.toml", fs.readFileSync(path.join(root, "assets/rubric.toml"), "utf8") + "\n[class]\ntraces = true\n");
  grade("class", path.join(work, "class"), "-o", path.join(work, "class-results"), "--html", pages, "--no-jacobians", "--rubric", rubric);
  const jacobians = path.join(work, "jacobians");
  grade("jacobians", "--html", jacobians);
  const accuracy = path.join(work, "accuracy");
  grade("accuracy", "--scene", "free-fall", "--quick", "--rungs", "3", "--html", accuracy);

  const stability = path.join(work, "stability");
  grade("stability", "--quick", "--html", stability);

  const gallery = path.join(work, "gallery");
  const scenes = path.join(work, "hand-ins/ada");
  fs.mkdirSync(scenes, { recursive: true });
  for (const name of ["garland_t1m2.xml", "jellyfish_all.xml"]) fs.copyFileSync(path.join(root, "creative", name), path.join(scenes, name));
  write("hand-ins/bob/<b>_t1m1.xml", "<scene>");
  grade("gallery", path.join(work, "hand-ins"), "-o", gallery);

  const browser = await chromium.launch({ executablePath: process.argv[2], args: ["--no-sandbox", "--disable-gpu", "--disable-quic"] });
  const origin = pathToFileURL(work).href;
  const url = (folder, name) => pathToFileURL(path.join(folder, name)).href;
  const kinds = [
    ["front", url(html, "index.html")],
    ["scene", url(html, `scenes/${SCENE}.html`)],
    ["scene-3d", url(html, "scenes/FastMassSpring/small-flag.html")],
    ["scene-passed", url(html, "scenes/Spring/shearing-pair-explicit.html")],
    ["class", url(pages, "index.html")],
    ["jacobians", url(jacobians, "index.html")],
    ["accuracy", url(accuracy, "index.html")],
    ["stability", url(stability, "index.html")],
    ["gallery", url(gallery, "index.html")],
  ];
  const looks = [
    ["", {}],
    ["-dark", { colorScheme: "dark" }],
    ["-narrow", { viewport: { width: 390, height: 800 } }],
  ];
  for (const [kind, address] of kinds) {
    for (const [look, options] of looks) {
      const { page, faults, close } = await open(browser, address, origin, options);
      await looksRight(page, kind + look);
      assert.deepEqual(faults, [], kind + look);
      await close();
    }
  }

  // Computing times, and the protections of this machine.
  const varying = { accuracy: "figure:first-of-type .drawing", class: ".score" };
  for (const [kind, address] of kinds) await comparePicture(browser, kind, address, varying[kind]);

  const { page, faults, close } = await open(browser, kinds[1][1], origin);
  await playback(page, expected.step);
  assert.deepEqual(faults, []);
  await close();
  await sideBySide(browser, kinds[1][1], origin);
  await strained(browser, url(html, "scenes/FiniteElements/three-sheets-in-space-linearized.html"), origin);
  await exploded(browser, url(html, `scenes/${EXPLODES}.html`), origin);
  const file = path.join(work, "report.html");
  grade(path.relative(root, traces), "--html", file, "--only", SCENE);
  await oneFile(browser, file, expected.step);

  // Filters of the front page.
  const front = await open(browser, kinds[0][1], origin);
  await front.page.locator("select[name=verdict]").selectOption("bad");
  assert.equal(await front.page.locator("[data-filtered] tbody tr:visible").count(), 3);
  await front.page.locator("input[name=text]").fill("triangle");
  assert.equal(await front.page.locator("[data-filtered] tbody tr:visible").count(), 1);
  await front.close();

  await playGallery(browser, url(gallery, "index.html"), origin);

  // Hostile text, in every page of every hostile submission's first scenes, and in the class page.
  for (let number = 0; number < HOSTILE.length; number++) {
    for (const name of ["index.html", `scenes/${SCENE}.html`]) {
      const hostile = await open(browser, url(pages, `submissions/hostile-${number}/${name}`), origin);
      const wide = await hostile.page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
      assert.deepEqual([hostile.faults, wide], [[], 0], `hostile text ${number}, ${name}`);
      assert.notEqual(await hostile.page.title(), "run");
      assert.equal(await hostile.page.locator("main").isVisible(), true);
      if (name !== "index.html") {
        const said = await hostile.page.locator(".said").textContent();
        const plain = HOSTILE[number].replace(/\u001b\[[0-9;]*[A-Za-z]|\u001b\][^\u0007]*\u0007/g, "").replace(/[\u2028-\u202e]/g, "\ufffd");
        if (plain.trim() && plain.length < 2000) assert.ok(said.includes(plain), `hostile text ${number} is shown: ${said}`);
      }
      await hostile.close();
    }
  }

  // The same pages from a web server.
  const server = await serve(html);
  const address = `http://127.0.0.1:${server.address().port}/`;
  const served = await open(browser, `${address}scenes/${SCENE}.html`, address);
  assert.equal(await step(served.page), expected.step);
  assert.deepEqual(served.faults, []);
  await served.close();
  server.close();

  // Many particles.
  const many = path.join(work, "many");
  fs.mkdirSync(path.join(many, "assets/Net"), { recursive: true });
  fs.writeFileSync(path.join(many, "assets/Net/large.xml"), net(50));
  grade("oracle", "regenerate", "--root", many);
  grade("--root", many, "--no-jacobians", "--html", path.join(many, "pages"));
  const large = await open(browser, url(many, "pages/scenes/Net/large.html"), origin);
  const small = await open(browser, kinds[1][1], origin);
  const load = (each) => each.page.evaluate(() => Math.round(performance.getEntriesByType("navigation")[0].loadEventEnd));
  console.log(`browser: a scene opens in ${await load(small)} ms and plays ${await framesPerSecond(small.page)} frames a second; ` +
    `2500 particles: ${await load(large)} ms, ${await framesPerSecond(large.page)} frames a second`);
  assert.deepEqual([small.faults, large.faults], [[], []]);
  await small.close();
  await large.close();

  await checkViewer({ browser, work, simulate: path.join(root, "target/release/simulate"), open, looksRight });
  await browser.close();
  console.log(`browser: passed; ${size(html)} MB for ${graded.length} scenes; screenshots in ${path.relative(root, screenshots)}`);
}

// A swinging net of n by n particles.
function net(n) {
  const lines = ['<scene>', '<duration time="1.0"/>', '<integrator type="symplectic-euler" dt="0.01"/>', '<simplegravity fx="0" fy="-2"/>'];
  const springs = [];
  for (let i = 0; i < n; i++) {
    for (let j = 0; j < n; j++) {
      lines.push(`<particle m="0.1" px="${j / n}" py="${-i / n}" vx="0" vy="0" fixed="${i === 0 && (j === 0 || j === n - 1) ? 1 : 0}" radius="0.005"/>`);
      for (const other of [j + 1 < n ? i * n + j + 1 : -1, i + 1 < n ? (i + 1) * n + j : -1]) {
        if (other < 0) continue;
        lines.push(`<edge i="${i * n + j}" j="${other}" radius="0.002"/>`);
        springs.push(`<springforce edge="${springs.length}" k="60" l0="${1 / n}" b="0.05"/>`);
      }
    }
  }
  return [...lines, ...springs, "</scene>"].join("\n");
}

function size(folder) {
  const bytes = fs.readdirSync(folder, { recursive: true, withFileTypes: true })
    .filter((entry) => entry.isFile())
    .reduce((sum, entry) => sum + fs.statSync(path.join(entry.parentPath ?? entry.path, entry.name)).size, 0);
  return (bytes / 1e6).toFixed(1);
}

main().catch((error) => {
  console.error(`browser: ${error.stack}`);
  process.exit(1);
});
