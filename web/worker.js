"use strict";

/* Runs `grade` in a separate thread, so that the page stays alive. Files of scenes stay in memory from run to run.
 *
 * page ── { module } ──> the program; the scenes that it brings are laid out        ──> { ready }
 *      ── { number, name, files, args } ──> a hand-in of this name; a run          ──> { number, status, output, error, page } */

const PAGE = "/out/report.html";
const files = new Wasi.Files();
let program = null;
let last = null;

function run(args) {
  const output = [[], []];
  const take = (list) => (bytes) => list.push(bytes);
  const env = { XDG_CACHE_HOME: "/cache", NO_COLOR: "1" };
  const started = new Wasi.Run(files, { args: ["grade", ...args], env, output: take(output[0]), error: take(output[1]) });
  let status;
  try {
    status = started.start(program);
  } catch (error) {
    status = 3;
    output[1].push(new TextEncoder().encode(`internal error: ${error.message}\n`));
  }
  const text = (parts) => {
    const decoder = new TextDecoder();
    return parts.map((part) => decoder.decode(part, { stream: true })).join("") + decoder.decode();
  };
  return { status, output: text(output[0]), error: text(output[1]) };
}

/* The paths of all files of a folder in memory. */
function* paths(node, at) {
  for (const [name, entry] of node.entries) {
    if (entry.entries) yield* paths(entry, `${at}${name}/`);
    else yield `${at}${name}`;
  }
}

/* The names of the scenes, and the assignments with their titles. */
function facts() {
  const text = (path) => new TextDecoder().decode(files.read(path));
  const [scenes, assignments] = [[], []];
  for (const path of paths(files.root, "/")) {
    const scene = path.match(/\/(?:extracredit)?assets\/([^/]+\/[^/]+)\.(?:xml|json)$/);
    const assignment = path.match(/\/assets\/assignments\/([^/]+)\.toml$/);
    if (assignment) assignments.push({ name: assignment[1], title: text(path).match(/^title *= *"(.*)"/m)?.[1] ?? "" });
    else if (scene) scenes.push(scene[1]);
  }
  return { scenes, assignments: assignments.sort((a, b) => a.name.localeCompare(b.name)) };
}

onmessage = ({ data }) => {
  if (data.module) {
    program = data.module;
    files.write("/tmp/.keep", new Uint8Array());
    files.write("/out/.keep", new Uint8Array());
    const opened = run(["assignments"]);
    postMessage({ ready: opened.status === 0, error: opened.error, ...facts() });
    return;
  }
  for (const path of [last, PAGE]) if (path && files.place(path).node) files.remove(path);
  last = data.name;
  for (const [path, bytes] of data.files) files.write(path, bytes);
  const ended = run(["--no-progress", "--no-jacobians", "--html", PAGE, ...data.args, "--", data.name]);
  postMessage({ number: data.number, ...ended, page: files.read(PAGE)?.slice() ?? null });
};
