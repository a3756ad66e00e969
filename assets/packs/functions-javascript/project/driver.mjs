// node driver.mjs SCENE TRACE              takes the steps of a scene with the functions of forces.mjs
// node driver.mjs --calls CALLS ANSWERS    calls the functions, one in each line

import { readFileSync, writeFileSync } from "node:fs";
import * as forces from "./forces.mjs";

if (process.argv[2] === "--calls") {
    answer(...process.argv.slice(3));
    process.exit(0);
}

// A line of calls: the function, the dimension, masses, positions and velocities of the particles, parameters. A line of answers: the
// force on each particle.
function answer(path, target) {
    const pair = ([x, y]) => [x, y, -x, -y];
    const calls = {
        gravity: (m, x, y, vx, vy, gx, gy) => forces.simpleGravity(m, [gx, gy]),
        drag: (m, x, y, vx, vy, b) => forces.drag([vx, vy], b),
        spring: (mi, mj, xi, yi, xj, yj, ui, vi, uj, vj, k, l0, b) => pair(forces.spring([xi, yi], [xj, yj], [ui, vi], [uj, vj], k, l0, b)),
        gravitation: (mi, mj, xi, yi, xj, yj, ui, vi, uj, vj, G) => pair(forces.gravitation([xi, yi], [xj, yj], mi, mj, G)),
    };
    const lines = readFileSync(path, "utf8").trim().split("\n").map((line) => line.split(" "));
    const answers = lines.map(([name, , ...numbers]) => calls[name](...numbers.map(Number)));
    writeFileSync(target, answers.map((values) => values.join(" ") + "\n").join(""));
}

const [, , path, target] = process.argv;
const text = readFileSync(path, "utf8").replace(/<!--[^]*?-->/g, "");
const elements = [...text.matchAll(/<(\w+)((?:\s+\w+\s*=\s*(?:"[^"]*"|'[^']*'))*)\s*\/?>/g)].map(([, tag, rest]) => {
    const attributes = [...rest.matchAll(/(\w+)\s*=\s*(?:"([^"]*)"|'([^']*)')/g)];
    return { ...Object.fromEntries(attributes.map(([, name, a, b]) => [name, a ?? b])), tag };
});
const all = (tag) => elements.filter((element) => element.tag === tag);
const read = (element, ...names) => names.map((name) => Number(element[name] ?? 0));
const particles = all("particle");
const m = particles.map((p) => Number(p.m));
const x = particles.map((p) => read(p, "px", "py"));
const v = particles.map((p) => read(p, "vx", "vy"));
const edges = all("edge").map((e) => read(e, "i", "j"));

function total() {
    const f = m.map(() => [0, 0]);
    const add = (i, [a, b], sign = 1) => { f[i] = [f[i][0] + sign * a, f[i][1] + sign * b]; };
    const addPair = (i, j, force) => { add(i, force); add(j, force, -1); };
    const each = (force) => m.forEach((_, i) => add(i, force(i)));
    for (const e of all("simplegravity")) each((i) => forces.simpleGravity(m[i], read(e, "fx", "fy")));
    for (const e of all("dragdamping")) each((i) => forces.drag(v[i], ...read(e, "b")));
    for (const e of all("springforce")) {
        const [i, j] = edges[Number(e.edge)];
        addPair(i, j, forces.spring(x[i], x[j], v[i], v[j], ...read(e, "k", "l0", "b")));
    }
    for (const e of all("gravitationalforce")) {
        const [i, j] = read(e, "i", "j");
        addPair(i, j, forces.gravitation(x[i], x[j], m[i], m[j], ...read(e, "G")));
    }
    return f;
}

const [{ type, dt: step }] = all("integrator");
const dt = Number(step);
const rows = [["step", "time", ...m.flatMap((_, i) => [`x${i}`, `y${i}`, `vx${i}`, `vy${i}`])]];
for (let n = 0; n <= Math.ceil(Number(all("duration")[0].time) / dt); ++n) {
    if (n > 0) {
        const f = total(), old = v.map((each) => [...each]);
        particles.forEach((p, i) => [0, 1].forEach((a) => {
            if (p.fixed !== "1") v[i][a] += dt * f[i][a] / m[i];
            x[i][a] += dt * (type === "explicit-euler" ? old : v)[i][a];
        }));
    }
    rows.push([n, n * dt, ...m.flatMap((_, i) => [...x[i], ...v[i]])]);
}
writeFileSync(target, rows.join("\n") + "\n");
