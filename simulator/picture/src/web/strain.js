"use strict";

/* Elements of elastic bodies, coloured by strain: the largest |σ − 1| of the principal stretches σ, as in the frames of
 * `simulate --strain`. The last colour is that of the largest strain shown so far, rounded up to 1, 2 or 5 times a power of ten.
 *
 * data: {colors, elements: [{corners, faces, rest}]}; colours are "rrggbb", and `rest` are the undeformed corners. */
Report.Strain = class {
  constructor({ colors, elements }, dimension) {
    this.dimension = dimension;
    this.colors = colors.map((text) => [0, 2, 4].map((at) => parseInt(text.slice(at, at + 2), 16)));
    this.elements = elements.map((element) => ({ ...element, rest: Report.Strain.edges(element.rest) }));
    this.full = 0;
  }

  /* Vectors from the first corner to the others. */
  static edges([first, ...others]) {
    return others.map((end) => end.map((value, axis) => value - first[axis]));
  }

  static dot(a, b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  }

  static cross(a, b) {
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  }

  /* Each face, `[color, corners]`, where `point(particle)` says the places of particles. */
  faces(point) {
    const strains = this.elements.map(({ corners, rest }) => this.of(rest, Report.Strain.edges(corners.map(point))));
    const largest = strains.reduce((most, strain) => (Number.isFinite(strain) ? Math.max(most, strain) : most), this.full);
    if (largest > this.full) {
      const unit = 10 ** Math.floor(Math.log10(largest));
      this.full = [1, 2, 5, 10].map((factor) => factor * unit).find((each) => each >= largest) ?? largest;
    }
    return this.elements.flatMap(({ faces }, number) => {
      const color = this.color(strains[number] / this.full);
      return faces.map((face) => [color, face]);
    });
  }

  /* The strain of an element, by its edges. */
  of(rest, now) {
    const stretches = rest.length === 2 ? this.ofTriangle(rest, now) : this.ofTetrahedron(rest, now);
    return stretches.reduce((most, stretch) => Math.max(most, Math.abs(stretch - 1)), 0);
  }

  /* σ1² + σ2² = tr G⁻¹H and σ1 σ2 = J, of the scalar products G of the edges at rest and H of those now. */
  ofTriangle(rest, now) {
    const { dot, cross } = Report.Strain;
    const [[a, b, c], [p, q, r]] = [rest, now].map(([u, v]) => [dot(u, u), dot(u, v), dot(v, v)]);
    const normals = [rest, now].map(([u, v]) => cross(u, v));
    const [area, nowArea] = normals.map((normal) => Math.hypot(...normal));
    const ratio = this.dimension === 2 ? normals[1][2] / normals[0][2] : nowArea / area;
    const trace = (c * p - 2 * b * q + a * r) / (area * area);
    const [sum, difference] = [ratio, -ratio].map((each) => Math.sqrt(Math.max(0, trace + 2 * each)));
    return [(sum + difference) / 2, (sum - difference) / 2];
  }

  /* σ² are the roots of λ³ − tr(G⁻¹H) λ² + tr(G N)/det G λ − J², of the scalar products N of the cross products now. */
  ofTetrahedron(rest, now) {
    const { dot, cross } = Report.Strain;
    const normals = ([u, v, w]) => [cross(v, w), cross(w, u), cross(u, v)];
    const determinant = dot(rest[0], normals(rest)[0]);
    const sum = (a, b) => {
      let sum = 0;
      for (let i = 0; i < 3; i++) for (let j = 0; j < 3; j++) sum += dot(a[i], a[j]) * dot(b[i], b[j]);
      return sum / determinant ** 2;
    };
    const [trace, areas] = [sum(normals(rest), now), sum(rest, normals(now))];
    const volume = dot(now[0], normals(now)[0]) / determinant;
    const mean = trace / 3;
    const p = Math.max(0, mean * mean - areas / 3);
    const q = mean ** 3 - 0.5 * mean * areas + 0.5 * volume * volume;
    const angle = p > 0 ? Math.acos(Math.max(-1, Math.min(1, q / p ** 1.5))) / 3 : 0;
    const stretches = [0, -1, 1].map((third) => Math.sqrt(Math.max(0, mean + 2 * Math.sqrt(p) * Math.cos(angle + (third * 2 * Math.PI) / 3))));
    stretches[2] *= Math.sign(volume);
    return stretches;
  }

  /* Red, green and blue of a share of the scale. */
  color(share) {
    const place = Math.max(0, Math.min(1, share || 0)) * (this.colors.length - 1);
    const first = Math.min(Math.floor(place), this.colors.length - 2);
    return this.colors[first].map((low, part) => Math.round(low + (place - first) * (this.colors[first + 1][part] - low)));
  }

  /* The scale, its upper left corner at (x, y). */
  legend(context, x, y, ink) {
    const width = 12;
    this.colors.forEach((color, number) => {
      context.fillStyle = `rgb(${color.join()})`;
      context.fillRect(x + width * number, y, width, 8);
    });
    context.fillStyle = ink;
    context.font = "12px system-ui, sans-serif";
    context.fillText(`strain 0 to ${Report.short(this.full)}`, x + width * this.colors.length + 6, y + 8);
  }
};
