"use strict";

// A page of target/web, opened as a file in Chromium without a network: console errors, faults and requests are problems.
const assert = require("node:assert/strict");
const path = require("node:path");
const { pathToFileURL } = require("node:url");
const { chromium } = require("playwright-core");
const axe = require("axe-core");

const root = path.resolve(__dirname, "../..");
const work = path.join(root, "target/browser/web");

/* Opens a browser: its page, the address of a file of target/web, pictures by name, and the checks at the end. */
async function open(executable, name, viewport) {
  const browser = await chromium.launch({ executablePath: executable, args: ["--no-sandbox"] });
  const context = await browser.newContext({ viewport, offline: true });
  const page = await context.newPage();
  const problems = [];
  page.on("console", (message) => message.type() === "error" && problems.push(message.text()));
  page.on("pageerror", (error) => problems.push(error.message));
  page.on("request", (request) => {
    if (!/^(file|blob|data):/.test(request.url())) problems.push(`request: ${request.url()}`);
  });
  return {
    page,
    address: pathToFileURL(path.join(root, "target/web", name)).href,
    shot: (picture) => page.screenshot({ path: path.join(work, `${path.parse(name).name}-${picture}.png`) }),

    /* On a phone: nothing off the screen, no barrier that axe finds; then no problem since the browser was opened. */
    async close(axeOptions) {
      await page.setViewportSize({ width: 360, height: 740 });
      const wide = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
      assert.ok(wide <= 0, `wider than a phone by ${wide} px`);
      await this.shot("phone");
      await page.evaluate(axe.source);
      const { violations } = await page.evaluate((options) => axe.run(document.body, options), axeOptions ?? {});
      assert.deepEqual(violations.map(({ id, nodes }) => `${id}: ${nodes[0].html}`), []);
      assert.deepEqual(problems, []);
      await browser.close();
    },
  };
}

/* Runs a check with the path of Chromium that the command line names. */
function check(main) {
  main(process.argv[2]).catch((error) => {
    console.error(error);
    process.exit(1);
  });
}

module.exports = { root, work, open, check };
