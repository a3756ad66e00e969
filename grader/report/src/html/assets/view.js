"use strict";

/* Drawing of the motion on a canvas: the submission, solid, over the oracle, hollow.
 *
 * World coordinates are those of the scene, y upwards; scenes in 3D turn about the middle of their motion. Particles
 * further away are smaller and paler. Shapes of one colour and depth share paths: thousands play smoothly. */
Report.View = class {
  /* Depths that are drawn differently. */
  static LAYERS = 6;

  /* Particles whose paths are all drawn. */
  static PATHS = 40;
  /* Lines in one path: longer paths take more time for each line. */
  static TOGETHER = 50;
  /* From this many particles on, they are drawn as squares. */
  static MANY = 1000;

  constructor(canvas, data) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.data = data;
    this.count = data.positions.length / data.frames.length / data.dimension;
    this.oracle = new Float64Array(3 * this.count);
    this.got = new Float64Array(3 * this.count);
    this.screen = { oracle: new Float64Array(3 * this.count), got: new Float64Array(3 * this.count) };
    this.fixed = new Set(data.fixed);
    this.options = { ghost: true, arrows: true, paths: false, forces: false, strain: false };
    this.strain = data.strain ? new Report.Strain(data.strain, data.dimension) : null;
    this.selected = data.firstWrong ? data.firstWrong.particle : null;
    this.theme();
    this.home();
    this.resize();
  }

  theme() {
    const names = ["paper", "grid", "ink", "faint", "oracle", "submission", "wrong", "arrow", "force"];
    this.colors = Object.fromEntries(names.map((name) => [name, Report.color(name)]));
  }

  /* Whether the submission has a state in this frame. */
  hasGot(frame) {
    return frame < this.data.nGot;
  }

  /* The oracle's coordinate, of a frame. */
  expected(frame, particle, axis) {
    const { dimension, low, unit, positions } = this.data;
    return axis < dimension ? low[axis] + unit * positions[(frame * this.count + particle) * dimension + axis] : 0;
  }

  /* The submission's coordinate minus the oracle's. */
  difference(frame, particle, axis) {
    const { dimension, differences } = this.data;
    if (!differences || axis >= dimension) return 0;
    return differences[(frame * this.count + particle) * dimension + axis];
  }

  /* Shows all of the oracle's motion, and of the submission's what is near. */
  home() {
    const { frames, dimension } = this.data;
    const low = [0, 0, 0];
    const high = [0, 0, 0];
    for (let axis = 0; axis < dimension; axis++) {
      let a = Infinity;
      let b = -Infinity;
      let c = Infinity;
      let d = -Infinity;
      for (let frame = 0; frame < frames.length; frame++) {
        for (let particle = 0; particle < this.count; particle++) {
          const x = this.expected(frame, particle, axis);
          if (x < a) a = x;
          if (x > b) b = x;
          if (!this.hasGot(frame)) continue;
          const y = x + this.difference(frame, particle, axis);
          if (y < c) c = y;
          if (y > d) d = y;
        }
      }
      const near = Math.max(b - a, 1e-9);
      low[axis] = Math.max(Math.min(a, c), a - near / 2);
      high[axis] = Math.min(Math.max(b, d), b + near / 2);
    }
    this.center = low.map((value, axis) => (value + high[axis]) / 2);
    const radius = this.data.radii.reduce((most, each) => Math.max(most, each), 0);
    this.size = low.map((value, axis) => Math.max(high[axis] - value + 2 * radius, 1e-9));
    this.extent = Math.max(...this.size);
    this.zoom = 1;
    this.pan = [0, 0];
    this.turn = dimension === 3 ? [0.6, 0.35] : [0, 0];
  }

  /* Takes the size of the canvas; to be called when it changes. */
  resize() {
    const ratio = devicePixelRatio || 1;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
      this.canvas.width = Math.round(width * ratio);
      this.canvas.height = Math.round(height * ratio);
    }
    this.width = width;
    this.height = height;
    this.context.setTransform(ratio, 0, 0, ratio, 0, 0);
  }

  /* Pixels a metre, in the middle of the view. */
  get scale() {
    const { width, height, size } = this;
    const fit = this.data.dimension === 3
      ? Math.min(width, height) / Math.hypot(...size)
      : Math.min(width / size[0], height / size[1]);
    return 0.9 * fit * this.zoom;
  }

  /* The place of a point on the screen, and its factor of perspective. */
  project(x, y, z, into, at, scale = this.scale) {
    let [a, b, c] = [x - this.center[0], y - this.center[1], z - this.center[2]];
    let factor = 1;
    if (this.data.dimension === 3) {
      const [yaw, pitch] = this.turn;
      const [sy, cy, sp, cp] = [Math.sin(yaw), Math.cos(yaw), Math.sin(pitch), Math.cos(pitch)];
      [a, c] = [cy * a + sy * c, cy * c - sy * a];
      [b, c] = [cp * b - sp * c, cp * c + sp * b];
      // The camera is three extents away, on the side of positive z.
      factor = 3 / Math.max(0.3, 3 - c / this.extent);
    }
    into[at] = this.width / 2 + this.pan[0] + a * scale * factor;
    into[at + 1] = this.height / 2 + this.pan[1] - b * scale * factor;
    into[at + 2] = factor;
  }

  /* Interpolates the states between a frame and the next one. */
  place(frame, share) {
    const next = Math.min(frame + 1, this.data.frames.length - 1);
    const shown = this.hasGot(frame);
    const both = shown && this.hasGot(next);
    for (let particle = 0; particle < this.count; particle++) {
      for (let axis = 0; axis < 3; axis++) {
        const a = this.expected(frame, particle, axis);
        const b = share > 0 ? this.expected(next, particle, axis) : a;
        this.oracle[3 * particle + axis] = a + share * (b - a);
        if (!shown) continue;
        const c = this.difference(frame, particle, axis);
        const d = share > 0 && both ? this.difference(next, particle, axis) : c;
        this.got[3 * particle + axis] = this.oracle[3 * particle + axis] + c + share * (d - c);
      }
    }
    const { scale } = this;
    for (const name of ["oracle", "got"]) {
      if (name === "got" && !shown) continue;
      for (let at = 0; at < 3 * this.count; at += 3) {
        const from = this[name];
        this.project(from[at], from[at + 1], from[at + 2], this.screen[name], at, scale);
      }
    }
    return shown;
  }

  draw(frame, share) {
    const { context } = this;
    context.fillStyle = this.colors.paper;
    context.fillRect(0, 0, this.width, this.height);
    if (this.data.dimension === 3) this.triad();
    else this.grid();
    const shown = this.place(frame, share);
    const strained = this.options.strain && this.strain;
    if (strained) this.strained(shown ? "got" : "oracle");
    if (this.options.paths) this.paths(frame);
    if (this.options.ghost || !shown) {
      // Where the submission agrees to the eye, its lines cover the oracle's.
      if (this.data.differences || !shown) this.lines("oracle", this.colors.oracle, shown ? 1 : 1.5);
      this.dots("oracle", this.colors.oracle, true);
    }
    if (shown) {
      this.lines("got", this.colors.submission, 1.75);
      this.dots("got", this.colors.submission, false);
    }
    this.longestForce = this.options.forces && this.data.forces ? this.forces(frame, shown) : 0;
    const gain = shown && this.options.arrows ? this.arrows(frame, share) : null;
    this.mark(frame, shown);
    this.ruler();
    if (strained) this.strain.legend(context, 14, 12, this.colors.faint);
    return gain;
  }

  /* The layer of a factor of perspective: 0 is far. */
  layer(factor) {
    if (this.data.dimension < 3) return Report.View.LAYERS - 1;
    const reach = (this.extent * 0.9) / (3 * this.extent);
    const depth = (factor - 1 / (1 + reach)) / (1 / (1 - reach) - 1 / (1 + reach));
    return Math.max(0, Math.min(Report.View.LAYERS - 1, Math.floor(depth * Report.View.LAYERS)));
  }

  alpha(layer) {
    return 0.35 + (0.65 * (layer + 1)) / Report.View.LAYERS;
  }

  lines(name, color, width) {
    const { context } = this;
    const at = this.screen[name];
    for (const [list, dash] of [[this.data.edges, []], [this.data.pairs, [2, 4]]]) {
      if (!list.length) continue;
      const layers = Array.from({ length: Report.View.LAYERS }, () => []);
      const counts = new Uint32Array(Report.View.LAYERS);
      for (const [i, j] of list) {
        const layer = this.layer((at[3 * i + 2] + at[3 * j + 2]) / 2);
        if (counts[layer]++ % Report.View.TOGETHER === 0) layers[layer].push(new Path2D());
        const path = layers[layer].at(-1);
        path.moveTo(at[3 * i], at[3 * i + 1]);
        path.lineTo(at[3 * j], at[3 * j + 1]);
      }
      context.strokeStyle = color;
      context.lineWidth = dash.length ? 1 : width;
      context.setLineDash(dash);
      layers.forEach((paths, layer) => {
        context.globalAlpha = this.alpha(layer) * (dash.length ? 0.6 : 1);
        for (const path of paths) context.stroke(path);
      });
      context.setLineDash([]);
      context.globalAlpha = 1;
    }
  }

  /* The faces of elastic bodies, coloured by strain: the furthest first. */
  strained(name) {
    const { context } = this;
    const [at, from] = [this.screen[name], this[name]];
    const faces = this.strain.faces((particle) => from.subarray(3 * particle, 3 * particle + 3));
    const depth = (corners) => corners.reduce((sum, corner) => sum + at[3 * corner + 2], 0);
    if (this.data.dimension === 3) faces.sort(([, a], [, b]) => depth(a) - depth(b));
    for (const [color, corners] of faces) {
      context.fillStyle = `rgb(${color.join()})`;
      context.beginPath();
      for (const corner of corners) context.lineTo(at[3 * corner], at[3 * corner + 1]);
      context.fill();
    }
  }

  /* Radius of a particle on the screen, at this scale. */
  radius(particle, scale) {
    const { radii } = this.data;
    const radius = radii.length > 1 ? radii[particle] : radii[0];
    const most = this.count > 200 ? 4 : 9;
    return Math.min(most, Math.max(this.count > 1000 ? 1.5 : 2.5, radius * scale));
  }

  dots(name, color, hollow) {
    const { context } = this;
    const at = this.screen[name];
    const { scale } = this;
    const many = this.count > Report.View.MANY;
    const layers = Array.from({ length: Report.View.LAYERS }, () => []);
    for (let particle = 0; particle < this.count; particle++) {
      const [x, y] = [at[3 * particle], at[3 * particle + 1]];
      if (x < -50 || y < -50 || x > this.width + 50 || y > this.height + 50) continue;
      layers[this.layer(at[3 * particle + 2])].push(particle);
    }
    context.lineWidth = 1.25;
    context[hollow ? "strokeStyle" : "fillStyle"] = color;
    layers.forEach((particles, layer) => {
      context.globalAlpha = this.alpha(layer);
      const path = many ? null : new Path2D();
      for (const particle of particles) {
        const [x, y, factor] = [at[3 * particle], at[3 * particle + 1], at[3 * particle + 2]];
        const r = this.radius(particle, scale) * factor + (hollow ? 1.5 : 0);
        if (many) context[hollow ? "strokeRect" : "fillRect"](x - r, y - r, 2 * r, 2 * r);
        else if (this.fixed.has(particle)) path.rect(x - r, y - r, 2 * r, 2 * r);
        else {
          path.moveTo(x + r, y);
          path.arc(x, y, r, 0, 2 * Math.PI);
        }
      }
      if (path) context[hollow ? "stroke" : "fill"](path);
    });
    context.globalAlpha = 1;
  }

  /* Arrows from the oracle's particles along the differences, scaled to be seen; returns their factor. */
  arrows(frame, share) {
    const next = Math.min(frame + 1, this.data.nGot - 1);
    const part = (particle, axis) => {
      const from = this.difference(frame, particle, axis);
      return from + share * (this.difference(next, particle, axis) - from);
    };
    const { gain } = this.vectors("oracle", part, this.colors.arrow, 1);
    return gain || null;
  }

  /* Arrows along the forces on the submission's particles, or on the oracle's where it has no state; returns the largest. */
  forces(frame, shown) {
    const { dimension, forces } = this.data;
    const part = (particle, axis) => (axis < dimension ? forces[(frame * this.count + particle) * dimension + axis] : 0);
    return this.vectors(shown ? "got" : "oracle", part, this.colors.force, 0).largest;
  }

  /* Draws a vector at each particle, magnified so that the largest can be seen, at least `least` times. Returns the factor and
   * the largest length; both are 0 where all are 0. */
  vectors(name, part, color, least) {
    const { context } = this;
    const sizes = new Float64Array(this.count);
    for (let particle = 0; particle < this.count; particle++) {
      sizes[particle] = Math.hypot(part(particle, 0), part(particle, 1), part(particle, 2));
    }
    const largest = sizes.reduce((most, size) => Math.max(most, size), 0);
    if (!(largest > 0)) return { gain: 0, largest: 0 };
    const wanted = (0.14 * Math.min(this.width, this.height)) / this.scale;
    const gain = Math.max(least, wanted / largest);
    const end = [0, 0, 0];
    const path = new Path2D();
    for (let particle = 0; particle < this.count; particle++) {
      if (sizes[particle] < 0.02 * largest) continue;
      const [from, start] = [this.screen[name], this[name]];
      const [x, y] = [from[3 * particle], from[3 * particle + 1]];
      this.project(...[0, 1, 2].map((axis) => start[3 * particle + axis] + gain * part(particle, axis)), end, 0);
      const angle = Math.atan2(end[1] - y, end[0] - x);
      path.moveTo(x, y);
      path.lineTo(end[0], end[1]);
      for (const side of [2.6, -2.6]) {
        path.moveTo(end[0], end[1]);
        path.lineTo(end[0] + 7 * Math.cos(angle + side), end[1] + 7 * Math.sin(angle + side));
      }
    }
    context.strokeStyle = color;
    context.lineWidth = 2;
    context.stroke(path);
    return { gain, largest };
  }

  /* The ways of the particles up to a frame: of all where they are few, of the selected one otherwise. */
  paths(frame) {
    const { context } = this;
    const particles = this.count <= Report.View.PATHS ? [...Array(this.count).keys()] : this.selected === null ? [] : [this.selected];
    const point = [0, 0, 0];
    const trail = (particle, withDifference) => {
      const path = new Path2D();
      for (let each = 0; each <= frame && (!withDifference || this.hasGot(each)); each++) {
        const of = (axis) =>
          this.expected(each, particle, axis) + (withDifference ? this.difference(each, particle, axis) : 0);
        this.project(of(0), of(1), of(2), point, 0);
        path[each ? "lineTo" : "moveTo"](point[0], point[1]);
      }
      return path;
    };
    context.globalAlpha = 0.55;
    context.lineWidth = 1;
    for (const particle of particles) {
      context.setLineDash([3, 3]);
      context.strokeStyle = this.colors.oracle;
      context.stroke(trail(particle, false));
      context.setLineDash([]);
      context.strokeStyle = this.colors.submission;
      context.stroke(trail(particle, true));
    }
    context.globalAlpha = 1;
  }

  /* Marks the first wrong particle and the selected one. */
  mark(frame, shown) {
    const { firstWrong, frames } = this.data;
    const at = shown ? this.screen.got : this.screen.oracle;
    if (firstWrong && frames[frame] >= firstWrong.step) this.ring(at, firstWrong.particle, this.colors.wrong, "wrong: ", 14);
    if (this.selected !== null && this.selected !== firstWrong?.particle) {
      this.ring(at, this.selected, this.colors.ink, "", 12);
    }
  }

  ring(at, particle, color, words, radius) {
    const { context } = this;
    const [x, y] = [at[3 * particle], at[3 * particle + 1]];
    if (!Number.isFinite(x + y)) return;
    context.strokeStyle = color;
    context.lineWidth = 2;
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      context.moveTo(x + dx * radius, y + dy * radius);
      context.lineTo(x + dx * (radius + 5), y + dy * (radius + 5));
    }
    context.stroke();
    const text = `${words}particle ${particle}`;
    context.font = "600 13px system-ui, sans-serif";
    const [left, bottom] = this.labelPlace(at, x, y, radius, context.measureText(text).width);
    context.strokeStyle = this.colors.paper;
    context.lineWidth = 4;
    context.lineJoin = "round";
    context.strokeText(text, left, bottom);
    context.fillStyle = color;
    context.fillText(text, left, bottom);
  }

  /* The place around a ring where its label covers the fewest particles. */
  labelPlace(at, x, y, radius, width) {
    const [right, left, middle] = [x + radius + 6, x - radius - 6 - width, x - width / 2];
    const [above, below] = [y - radius, y + radius + 8];
    const places = [[right, above], [left, above], [right, below], [left, below], [middle, above - 10], [middle, below + 10]]
      .map(([left, bottom]) => [
        Math.min(Math.max(4, left), this.width - width - 4), Math.min(Math.max(16, bottom), this.height - 6),
      ]);
    const covered = places.map(([left, bottom]) => {
      let count = 0;
      for (let particle = 0; particle < this.count; particle++) {
        const [dx, dy] = [at[3 * particle] - left, at[3 * particle + 1] - bottom];
        if (dx > -12 && dx < width + 12 && dy > -24 && dy < 14) count++;
      }
      return count;
    });
    return places[covered.indexOf(Math.min(...covered))];
  }

  /* A length of 1, 2 or 5 times a power of ten, about `pixels` long. */
  round(pixels) {
    const rough = pixels / this.scale;
    const unit = 10 ** Math.floor(Math.log10(rough));
    return [1, 2, 5, 10].map((factor) => factor * unit).filter((each) => each <= rough).pop() ?? unit;
  }

  grid() {
    const { context } = this;
    const step = this.round(90);
    const left = this.center[0] - (this.width / 2 + this.pan[0]) / this.scale;
    const top = this.center[1] + (this.height / 2 + this.pan[1]) / this.scale;
    context.strokeStyle = this.colors.grid;
    context.lineWidth = 1;
    context.beginPath();
    for (let k = Math.ceil(left / step); k * step < left + this.width / this.scale; k++) {
      const x = Math.round((k * step - left) * this.scale) + 0.5;
      context.moveTo(x, 0);
      context.lineTo(x, this.height);
    }
    for (let k = Math.floor(top / step); k * step > top - this.height / this.scale; k--) {
      const y = Math.round((top - k * step) * this.scale) + 0.5;
      context.moveTo(0, y);
      context.lineTo(this.width, y);
    }
    context.stroke();
  }

  /* The box of the motion, and the directions of the axes. */
  triad() {
    const { context } = this;
    const half = this.size.map((each) => each / 2);
    const corner = [0, 0, 0];
    const corners = [];
    for (let number = 0; number < 8; number++) {
      const of = (axis) => this.center[axis] + half[axis] * (number & (1 << axis) ? 1 : -1);
      this.project(of(0), of(1), of(2), corner, 0);
      corners.push([...corner]);
    }
    context.strokeStyle = this.colors.grid;
    context.lineWidth = 1;
    context.beginPath();
    for (let number = 0; number < 8; number++) {
      for (const bit of [1, 2, 4]) {
        if (number & bit) continue;
        context.moveTo(corners[number][0], corners[number][1]);
        context.lineTo(corners[number | bit][0], corners[number | bit][1]);
      }
    }
    context.stroke();
    context.font = "13px system-ui, sans-serif";
    context.fillStyle = this.colors.faint;
    ["x", "y", "z"].forEach((name, axis) => {
      const [x, y] = corners[1 << axis];
      context.fillText(name, x + 4, y - 4);
    });
  }

  ruler() {
    const { context } = this;
    const length = this.round(120);
    const [x, y, end] = [14, this.height - 14, 14 + length * this.scale];
    context.strokeStyle = this.colors.faint;
    context.fillStyle = this.colors.faint;
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(x, y - 4);
    context.lineTo(x, y);
    context.lineTo(end, y);
    context.lineTo(end, y - 4);
    context.stroke();
    context.font = "12px system-ui, sans-serif";
    context.fillText(`${Report.short(length)} m`, x + 4, y - 6);
  }

  /* The particle at a place on the screen; null where there is none. */
  at(x, y) {
    let [best, distance] = [null, 16];
    for (const at of [this.screen.oracle, this.screen.got]) {
      for (let particle = 0; particle < this.count; particle++) {
        const apart = Math.hypot(at[3 * particle] - x, at[3 * particle + 1] - y);
        if (apart < distance) [best, distance] = [particle, apart];
      }
    }
    return best;
  }
};
