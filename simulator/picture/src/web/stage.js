"use strict";

/* Draws a scene on a canvas as the scene says: radii, colours, edges, faces, trails, background, viewport. The same picture
 * as the frames of `simulate --frames`, but each triangle of a face has one colour; scenes in 3D turn.
 *
 * scene: {dimension, radii, colors, edges, edgeRadii, edgeColors, faces?, faceColors?, trails: [{particle, duration, color}], background,
 *         center, extents, viewport, fixed?}; `strain` is the data of strain.js, or null.
 * Colours are "rrggbb"; a list of equal values has one element. */
Report.Stage = class {
  /* Share of the picture that the extents fill, distance of the camera, and fading of the furthest point. */
  static ROOM = 0.9;
  static DISTANCE = 3;
  static FADE = 0.55;
  /* Share of a face's colour that needs no light; direction of the light from the surface: left, up, towards the viewer. */
  static AMBIENT = 0.35;
  static LIGHT = [-0.36, 0.48, 0.8];
  /* Shades of a colour. */
  static SHADES = 24;
  /* Shapes in one path: longer paths take more time for each shape. */
  static TOGETHER = 50;

  constructor(canvas, scene, strain = null) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.scene = scene;
    this.count = scene.count;
    this.screen = new Float64Array(4 * this.count);
    this.trails = scene.trails.map(() => []);
    this.shades = new Map();
    this.options = { edges: true, particles: true, faces: true, strain: false };
    const parts = [0, 2, 4].map((at) => parseInt(scene.background.slice(at, at + 2), 16));
    /* Whether dark lines are seen on the background. */
    this.light = parts[0] + parts[1] + parts[2] > 384;
    this.cover(scene.faces ?? []);
    if (strain) {
      this.strain = new Report.Strain(strain, scene.dimension);
      this.strained = this.covering(strain.elements.flatMap(({ faces }) => faces));
    }
    /* Size of the extents. */
    this.across = Math.hypot(...scene.extents);
    this.home();
    this.resize();
  }

  /* Divides faces into triangles. */
  cover(faces) {
    this.triangles = [];
    faces.forEach((face, number) => {
      for (let k = 2; k < face.length; k++) this.triangles.push([number, face[0], face[k - 1], face[k]]);
    });
    this.covers = this.covering(faces);
  }

  /* The edges and particles that faces cover. */
  covering(faces) {
    const [pairs, particles] = [new Set(), new Set(faces.flat())];
    for (const face of faces) for (const i of face) for (const j of face) pairs.add(i * this.count + j);
    return { edges: this.scene.edges.map(([i, j]) => pairs.has(i * this.count + j)), particles };
  }

  home() {
    this.zoom = 1;
    this.pan = [0, 0];
    this.turn = [0.6, 0.35];
  }

  /* Takes the size of the canvas; to be called when it changes. */
  resize() {
    const ratio = devicePixelRatio || 1;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    this.width = width;
    this.height = height;
    this.context.setTransform(ratio, 0, 0, ratio, 0, 0);
  }

  /* Pixels a metre, in the middle of the picture. */
  get scale() {
    const { width, height } = this;
    const { viewport, extents, dimension } = this.scene;
    let fit = Math.min(width / extents[0], height / extents[1]);
    if (dimension === 3) fit = Math.min(width, height) / this.across;
    return this.zoom * (viewport ? (0.5 * height) / viewport : Report.Stage.ROOM * fit);
  }

  /* Sine and cosine of both angles of the camera. */
  angles() {
    const [yaw, pitch] = this.turn;
    if (this.turned?.yaw !== yaw || this.turned.pitch !== pitch) {
      this.turned = { yaw, pitch, angles: [Math.sin(yaw), Math.cos(yaw), Math.sin(pitch), Math.cos(pitch)] };
    }
    return this.turned.angles;
  }

  /* Writes x, y, pixels a metre and depth (from 0, far, to 1, near) of a point. */
  project(x, y, z, into, at, scale = this.scale) {
    const { center, dimension } = this.scene;
    let [a, b, c] = [x - center[0], y - center[1], z - center[2]];
    let [perspective, depth] = [1, 1];
    if (dimension === 3) {
      const [sy, cy, sp, cp] = this.angles();
      [a, c] = [cy * a + sy * c, cy * c - sy * a];
      [b, c] = [cp * b - sp * c, cp * c + sp * b];
      const away = c / this.across;
      perspective = Report.Stage.DISTANCE / Math.max(Report.Stage.DISTANCE - away, 0.1 * Report.Stage.DISTANCE);
      depth = Math.max(0, Math.min(1, away + 0.5));
    }
    into[at] = this.width / 2 + this.pan[0] + a * scale * perspective;
    into[at + 1] = this.height / 2 + this.pan[1] - b * scale * perspective;
    into[at + 2] = scale * perspective;
    into[at + 3] = depth;
  }

  /* The point at (x, y) of the picture that is as far away as another point. */
  unproject(x, y, point) {
    const at = [0, 0, 0, 0];
    this.project(...point, at, 0);
    const { center, dimension } = this.scene;
    let [a, b, c] = [(x - this.width / 2 - this.pan[0]) / at[2], (this.height / 2 + this.pan[1] - y) / at[2], 0];
    if (dimension === 3) {
      const [sy, cy, sp, cp] = this.angles();
      const away = point.map((value, axis) => value - center[axis]);
      c = cp * (cy * away[2] - sy * away[0]) + sp * away[1];
      [b, c] = [cp * b + sp * c, cp * c - sp * b];
      [a, c] = [cy * a - sy * c, cy * c + sy * a];
    }
    return [center[0] + a, center[1] + b, dimension === 3 ? center[2] + c : 0];
  }

  /* The particle of the last picture that is nearest to (x, y), at most `reach` pixels away; null where there is none. */
  at(x, y, reach) {
    let [best, distance] = [null, reach];
    for (let particle = 0; particle < this.count; particle++) {
      const apart = Math.hypot(this.screen[4 * particle] - x, this.screen[4 * particle + 1] - y);
      if (apart <= distance) [best, distance] = [particle, apart];
    }
    return best;
  }

  /* A colour with a share of the background's. */
  shade(color, share) {
    const { SHADES } = Report.Stage;
    let shades = this.shades.get(color);
    if (!shades) {
      const parts = (text) => [0, 2, 4].map((at) => parseInt(text.slice(at, at + 2), 16));
      const [own, behind] = [parts(color), parts(this.scene.background)];
      shades = Array.from({ length: SHADES + 1 }, (_, shade) => {
        const mixed = own.map((value, part) => Math.round(value + ((behind[part] - value) * shade) / SHADES));
        return `rgb(${mixed.join()})`;
      });
      this.shades.set(color, shades);
    }
    return shades[Math.round(share * SHADES)];
  }

  /* A colour at a depth. */
  faded(color, depth) {
    return this.shade(color, Report.Stage.FADE * (1 - depth));
  }

  /* Forgets the trails. */
  reset() {
    this.trails = this.trails.map(() => []);
  }

  /* Adds a state to the trails. To be called for every state, in order. */
  follow(time, positions) {
    this.scene.trails.forEach(({ particle, duration }, number) => {
      const trail = this.trails[number];
      trail.push([time, ...this.point(positions, particle)]);
      while (trail.length && time - trail[0][0] > duration) trail.shift();
    });
  }

  point(positions, particle) {
    const { dimension } = this.scene;
    const at = particle * dimension;
    return [positions[at], positions[at + 1], dimension === 3 ? positions[at + 2] : 0];
  }

  draw(time, positions) {
    const { context, scene, screen } = this;
    const { scale } = this;
    context.fillStyle = `#${scene.background}`;
    context.fillRect(0, 0, this.width, this.height);
    for (let particle = 0; particle < this.count; particle++) {
      this.project(...this.point(positions, particle), screen, 4 * particle, scale);
    }
    context.lineCap = context.lineJoin = "round";
    const shapes = [];
    this.trailShapes(time, positions, scale, shapes);
    const of = (list, number) => (list.length > 1 ? list[number] : list[0]);
    const hasStrain = this.options.strain && this.strain;
    const hasFaces = this.options.faces && this.triangles.length && !hasStrain;
    const covered = hasStrain ? this.strained : hasFaces ? this.covers : null;
    if (hasFaces) this.faceShapes(positions, shapes);
    if (hasStrain) this.strainShapes(positions, shapes);
    if (this.options.edges) {
      scene.edges.forEach(([i, j], edge) => {
        if (covered?.edges[edge]) return;
        const [a, b] = [4 * i, 4 * j];
        const depth = (screen[a + 3] + screen[b + 3]) / 2;
        const width = Math.max(1, of(scene.edgeRadii, edge) * (screen[a + 2] + screen[b + 2]));
        const style = this.faded(of(scene.edgeColors, edge), depth);
        shapes.push([depth, style, width, screen[a], screen[a + 1], screen[b], screen[b + 1]]);
      });
    }
    if (this.options.particles) {
      for (let particle = 0; particle < this.count; particle++) {
        if (covered?.particles.has(particle)) continue;
        const at = 4 * particle;
        const radius = Math.max(0.75, of(scene.radii, particle) * screen[at + 2]);
        const depth = screen[at + 3];
        shapes.push([depth, this.faded(of(scene.colors, particle), depth), -radius, screen[at], screen[at + 1]]);
      }
    }
    // Stable: equal depths keep their order.
    if (scene.dimension === 3) shapes.sort((a, b) => a[0] - b[0]);
    this.paint(shapes);
    if (this.options.particles) this.frameFixed();
    if (hasStrain) this.strain.legend(context, 10, 10, this.light ? "#000000" : "#ffffff");
  }

  /* Stands fixed particles in squares: they are held. */
  frameFixed() {
    const { context, scene, screen } = this;
    context.lineWidth = 1.5;
    context.strokeStyle = this.light ? "#000000" : "#ffffff";
    for (const particle of scene.fixed ?? []) {
      const at = 4 * particle;
      const radius = scene.radii.length > 1 ? scene.radii[particle] : scene.radii[0];
      const half = Math.max(0.75, radius * screen[at + 2]) + 3;
      context.strokeRect(screen[at] - half, screen[at + 1] - half, 2 * half, 2 * half);
    }
  }

  /* Faces of elastic bodies, coloured by strain. */
  strainShapes(positions, shapes) {
    const { screen } = this;
    this.behind ??= [0, 2, 4].map((at) => parseInt(this.scene.background.slice(at, at + 2), 16));
    for (const [color, [i, j, k]] of this.strain.faces((particle) => this.point(positions, particle))) {
      const [p, q, r] = [4 * i, 4 * j, 4 * k];
      const depth = (screen[p + 3] + screen[q + 3] + screen[r + 3]) / 3;
      const fade = Report.Stage.FADE * (1 - depth);
      const style = `rgb(${color.map((value, part) => Math.round((1 - fade) * value + fade * this.behind[part])).join()})`;
      shapes.push([depth, style, 0, screen[p], screen[p + 1], screen[q], screen[q + 1], screen[r], screen[r + 1]]);
    }
  }

  /* Triangles, shaded by their direction. */
  faceShapes(positions, shapes) {
    const { scene, screen } = this;
    const { AMBIENT, LIGHT, FADE } = Report.Stage;
    const parts = (text) => [0, 2, 4].map((at) => parseInt(text.slice(at, at + 2), 16));
    this.faceParts ??= scene.faceColors.map(parts);
    this.behind ??= parts(scene.background);
    const [sy, cy, sp, cp] = this.angles();
    for (const [face, i, j, k] of this.triangles) {
      const [a, b, c] = [3 * i, 3 * j, 3 * k];
      const [ux, uy, uz] = [positions[b] - positions[a], positions[b + 1] - positions[a + 1], positions[b + 2] - positions[a + 2]];
      const [vx, vy, vz] = [positions[c] - positions[a], positions[c + 1] - positions[a + 1], positions[c + 2] - positions[a + 2]];
      const [nx, ny, nz] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
      // The normal as the camera sees it.
      const [x, away] = [cy * nx + sy * nz, cy * nz - sy * nx];
      const [y, z] = [cp * ny - sp * away, cp * away + sp * ny];
      const cosine = Math.abs(x * LIGHT[0] + y * LIGHT[1] + z * LIGHT[2]) / (Math.hypot(x, y, z) || 1);
      const [p, q, r] = [4 * i, 4 * j, 4 * k];
      const depth = (screen[p + 3] + screen[q + 3] + screen[r + 3]) / 3;
      const fade = FADE * (1 - depth);
      const light = (AMBIENT + (1 - AMBIENT) * cosine) * (1 - fade);
      const own = this.faceParts.length > 1 ? this.faceParts[face] : this.faceParts[0];
      const style = `rgb(${own.map((value, part) => Math.round(light * value + fade * this.behind[part])).join()})`;
      shapes.push([depth, style, 0, screen[p], screen[p + 1], screen[q], screen[q + 1], screen[r], screen[r + 1]]);
    }
  }

  /* Paints lines (positive widths), discs (negative radii) and triangles (0); neighbours of one style share a path. */
  paint(shapes) {
    const { context } = this;
    let [style, width, count] = [null, 0, 0];
    const finish = () => {
      if (style === null) return;
      if (width <= 0) context.fill();
      // The outline of a triangle closes the gap to its neighbours.
      if (width >= 0) context.stroke();
    };
    for (const [, next, size, x, y, x2, y2, x3, y3] of shapes) {
      if (!Number.isFinite(x + y)) continue;
      const same = next === style && (size > 0 ? Math.abs(size - width) < 0.05 : Math.sign(size) === Math.sign(width));
      if (!same || ++count > Report.Stage.TOGETHER) {
        finish();
        [style, width, count] = [next, size, 1];
        context.beginPath();
        if (size >= 0) {
          context.strokeStyle = next;
          context.lineWidth = size || 1;
        }
        if (size <= 0) context.fillStyle = next;
      }
      if (size > 0) {
        context.moveTo(x, y);
        context.lineTo(x2, y2);
      } else if (size === 0) {
        context.moveTo(x, y);
        context.lineTo(x2, y2);
        context.lineTo(x3, y3);
        context.closePath();
      } else {
        context.moveTo(x - size, y);
        context.arc(x, y, -size, 0, 2 * Math.PI);
      }
    }
    finish();
  }

  trailShapes(time, positions, scale, shapes) {
    const [from, to] = [[0, 0, 0, 0], [0, 0, 0, 0]];
    const { scene } = this;
    scene.trails.forEach(({ particle, duration, color }, number) => {
      const radius = 0.3 * (scene.radii.length > 1 ? scene.radii[particle] : scene.radii[0]);
      const points = [...this.trails[number], [time, ...this.point(positions, particle)]];
      for (let k = 0; k + 1 < points.length; k++) {
        this.project(...points[k].slice(1), from, 0, scale);
        this.project(...points[k + 1].slice(1), to, 0, scale);
        const age = Math.max(0, Math.min(1, (time - points[k][0]) / duration));
        const depth = (from[3] + to[3]) / 2;
        const style = this.shade(color, 1 - (1 - age) * (1 - Report.Stage.FADE * (1 - depth)));
        shapes.push([depth, style, Math.max(1, radius * (from[2] + to[2])), from[0], from[1], to[0], to[1]]);
      }
    });
  }
};
