"use strict";

// Compares pictures of pages with those in ci/browser/pictures/. Fonts differ between machines: a font of our own draws each
// character as a box of the same width, also on canvases, and without rounding to pixels. The rest is compared as
// means over cells of 16 by 16 pixels.
// `UPDATE_PICTURES=1 ci/browser.sh` rewrites the stored pictures, whose pixels are the means.
const assert = require("node:assert/strict");
const fs = require("node:fs");
const path = require("node:path");

const folder = path.join(__dirname, "pictures");

// Side of a cell; the largest difference of a cell that is equal, of 255; the share of cells that may differ.
const CELL = 16;
const TOLERANCE = 8;
const SHARE = 0.001;

// TrueType: one glyph, a box of 0.39 by 0.52 em, for all characters but spaces.
const FONT =
  "AAEAAAAKAIAAAwAgT1MvMl+AipIAAACsAAAAYGNtYXAAEDNBAAABDAAAAExnbHlmAwoFggAAAVgAAAAkaGVhZGE8Qu0AAAF8AAAANmhoZWEFrAF+" +
  "AAABtAAAACRobXR4AiYAUAAAAdgAAAAIbG9jYQASABIAAAHgAAAACG1heHAABQAFAAAB6AAAACBuYW1lBNwUogAAAggAAABicG9zdP+fADMAAAJs" +
  "AAAAIAAEAiYBkAAFAAACigK8AAAAjAKKArwAAAHgADIA+gAAAAAAAAAAAAAAAAAAAAEAAAAAAAAAAAAAAABOT05FAEAAIC//A4T/BgAAA4QA+gAA" +
  "AAEAAAAAAggCCAAAACAAAQAAAAEAAwAKAAAADAANAAAAAABAAAAAAAAAAAQAAAAgAAAAIAAAAAIAAAAhAAAAnwAAAAEAAACgAAAAoAAAAAIAAACh" +
  "AAAv/wAAAAEAAQBQAAAB1gIIAAMAAAEBAQEAUAGGAAD+egAAAAACCAAAAAAAAQAAAAEAAAUiYQNfDzz1AAMD6AAAAAAAAAAAAAAAAAAAAAAAUAAA" +
  "AdYCCAAAAAgAAgAAAAAAAAABAAADhP8GAAACJgBQAFAB1gABAAAAAAAAAAAAAAAAAAAAAQImAFAAAAAAAAAAAAASABIAAQAAAAMABAABAAAAAAAB" +
  "AAAAAAAAAAAAAAAAAAAAAAAAAAQANgADAAEECQABAAoAAAADAAEECQACAA4ACgADAAEECQAEAAoAGAADAAEECQAGAAoAIgBCAGwAbwBjAGsAUgBl" +
  "AGcAdQBsAGEAcgBCAGwAbwBjAGsAQgBsAG8AYwBrAAAAAwAAAAAAAP+cADIAAAABAAAAAAAAAAAAAAAAAAAAAA==";

/* In the page, before its own scripts. */
function drawTextAsBoxes(font) {
  document.fonts.add(new FontFace("Boxes", Uint8Array.from(atob(font), (digit) => digit.charCodeAt(0))));
  const sheet = new CSSStyleSheet();
  sheet.replaceSync("* { font-family: Boxes !important; text-rendering: geometricPrecision !important; }");
  document.adoptedStyleSheets = [sheet];
  const property = Object.getOwnPropertyDescriptor(CanvasRenderingContext2D.prototype, "font");
  Object.defineProperty(CanvasRenderingContext2D.prototype, "font", {
    get: property.get,
    set(value) {
      property.set.call(this, value.replace(/px .*/, "px Boxes"));
      this.textRendering = "geometricPrecision";
    },
  });
}

/* In a blank page: the mean colours of the cells of a PNG file, row by row. */
async function means([file, cell]) {
  const image = await createImageBitmap(await (await fetch(`data:image/png;base64,${file}`)).blob());
  const canvas = new OffscreenCanvas(image.width, image.height);
  const context = canvas.getContext("2d");
  context.drawImage(image, 0, 0);
  const width = image.width / cell;
  const cells = [];
  for (let y = 0; y < image.height; y += cell) {
    for (let x = 0; x < image.width; x += cell) {
      const { data } = context.getImageData(x, y, cell, cell);
      const mean = (channel) => Math.round(data.filter((_, at) => at % 4 === channel).reduce((a, b) => a + b, 0) / cell ** 2);
      cells.push([mean(0), mean(1), mean(2)]);
    }
  }
  return { width, cells };
}

/* In a blank page: a PNG file of these pixels. */
function encode({ width, cells }) {
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [width, cells.length / width];
  const context = canvas.getContext("2d");
  cells.forEach(([r, g, b], at) => {
    context.fillStyle = `rgb(${r} ${g} ${b})`;
    context.fillRect(at % width, Math.floor(at / width), 1, 1);
  });
  return canvas.toDataURL().replace(/.*,/, "");
}

/* Compares the upper part of a page. Elements that match `hidden` differ from run to run, or from machine to machine. */
module.exports = async function comparePicture(browser, name, address, hidden) {
  const context = await browser.newContext({ viewport: { width: 80 * CELL, height: 56 * CELL } });
  const blank = await context.newPage();
  const page = await context.newPage();
  await page.addInitScript(drawTextAsBoxes, FONT);
  await page.goto(address);
  await page.waitForFunction(() => [...document.querySelectorAll("canvas")].every(({ dataset }) => dataset.step ?? dataset.frame));
  await page.evaluate((hidden) => {
    const provenance = [...document.querySelectorAll("p")].filter((line) => line.textContent.startsWith("Graded by grade"));
    const varying = hidden ? [...document.querySelectorAll(hidden)] : [];
    for (const each of [...provenance, ...varying]) each.style.display = "none";
  }, hidden);
  const whole = await page.screenshot({ path: path.join(__dirname, "../../target/browser/screenshots", `${name}-boxes.png`) });
  const got = await blank.evaluate(means, [whole.toString("base64"), CELL]);
  const stored = path.join(folder, `${name}.png`);
  if (process.env.UPDATE_PICTURES) {
    fs.mkdirSync(folder, { recursive: true });
    fs.writeFileSync(stored, Buffer.from(await blank.evaluate(encode, got), "base64"));
  }
  const expected = await blank.evaluate(means, [fs.readFileSync(stored).toString("base64"), 1]);
  const differs = (cell, at) => cell.some((value, channel) => Math.abs(value - expected.cells[at][channel]) > TOLERANCE);
  const places = [...got.cells.keys()].filter((at) => differs(got.cells[at], at));
  const at = places.map((at) => `${CELL * (at % got.width)}, ${CELL * Math.floor(at / got.width)}`);
  assert.ok(places.length <= SHARE * got.cells.length,
    `${name}: ${places.length} of ${got.cells.length} cells differ from ci/browser/pictures/${name}.png, the first at ${at[0]}: look at ` +
    `target/browser/screenshots/${name}-boxes.png; UPDATE_PICTURES=1 ci/browser.sh takes it over`);
  await context.close();
};
