"use strict";

/* Playback of a scene: controls, time axis, keyboard, the numbers of a particle, and the charts that follow. */
Report.Player = class {
  static SPEEDS = [0.05, 0.1, 0.25, 0.5, 1, 2, 5, 10];
  /* Curves of the submission end where they are this many times the others. */
  static BEYOND = 4;

  constructor(host, data) {
    this.data = data;
    data.positions = Report.numbers(data.positions);
    const halves = (text) => (text ? Report.Player.differences(Report.numbers(text)) : null);
    data.differences = halves(data.differences);
    data.forces = halves(data.forces);
    this.last = data.frames.length - 1;
    this.frame = 0;
    this.share = 0;
    this.playing = false;
    this.charts = [];
    this.told = 0;
    this.build(host);
    this.view = new Report.View(this.canvas, data);
    this.listen();
    this.pathsPanel(host);
    this.residualCharts();
    this.energyCharts();
    new ResizeObserver(() => {
      this.view.resize();
      this.draw();
    }).observe(this.canvas);
    Report.onTheme(() => {
      this.view.theme();
      this.draw();
    });
    const asked = /^#step=(\d+)$/.exec(location.hash);
    this.seek(this.frameOf(asked ? Number(asked[1]) : data.firstWrong ? data.firstWrong.step : 0));
  }

  /* Numbers from the upper halves of 32-bit floats. */
  static differences(bits) {
    const words = new Uint32Array(bits.length);
    for (let i = 0; i < bits.length; i++) words[i] = bits[i] << 16;
    return new Float32Array(words.buffer);
  }

  build(host) {
    const { data } = this;
    const button = (name, words, label, action, key) => {
      const element = Report.element("button", { type: "button", "data-action": name, title: key ? `${label} (${key})` : label, "aria-label": label, "aria-keyshortcuts": key ?? null }, words);
      element.addEventListener("click", action);
      return element;
    };
    const option = (name, label, checked) => {
      const input = Report.element("input", { type: "checkbox", name, checked });
      input.addEventListener("change", () => {
        this.view.options[name] = input.checked;
        this.draw();
      });
      return Report.element("label", {}, input, label);
    };
    this.canvas = Report.element("canvas", { tabindex: 0, role: "img", "aria-describedby": "status" });
    this.playButton = button("play", "▶", "Play", () => this.toggle(), "k");
    this.speed = Report.element("select", { "aria-label": "Speed" },
      ...Report.Player.SPEEDS.map((speed) => Report.element("option", { value: speed }, `${speed} ×`)));
    this.speed.value = this.suggestedSpeed();
    this.slider = Report.element("input", { type: "range", min: 0, max: this.last, step: 1, value: 0, "aria-label": "Time" });
    this.slider.addEventListener("input", () => {
      this.pause();
      this.seek(Number(this.slider.value));
    });
    this.status = Report.element("output", { id: "status", class: "status" });
    this.particle = Report.element("input", { type: "number", min: 0, max: data.positions.length / data.frames.length / data.dimension - 1, "aria-label": "Particle" });
    this.particle.addEventListener("input", () => this.select(this.particle.value === "" ? null : Number(this.particle.value)));
    this.numbers = Report.element("div", { class: "numbers" });
    const buttons = [
      button("first", "|◀", "First state", () => this.jump(0), "Home"),
      button("back", "−1", "−1 step", () => this.step(-1), ","),
      this.playButton,
      button("forward", "+1", "+1 step", () => this.step(1), "."),
      button("last", "▶|", "Last state", () => this.jump(this.last), "End"),
    ];
    if (data.firstWrong) {
      buttons.push(button("wrong", "✗ First wrong step", "✗ First wrong step", () => this.jump(this.frameOf(data.firstWrong.step)), "w"));
    }
    const zoom = [
      button("out", "−", "Zoom out", () => this.zoom(1 / 1.25), "-"),
      button("in", "+", "Zoom in", () => this.zoom(1.25), "+"),
      button("home", "Fit", "Fit all in the picture", () => this.home(), "0"),
    ];
    const options = [option("ghost", "oracle", true)];
    if (data.differences) options.push(option("arrows", "differences", true));
    options.push(option("paths", "paths", false));
    if (data.forces) options.push(option("forces", "forces", false));
    if (data.strain) options.push(option("strain", "strain", false));
    const how = data.dimension === 3 ? "Drag to turn, with Shift to move" : "Drag to move";
    host.append(
      Report.element("div", { class: "stage" }, this.canvas),
      Report.element("div", { class: "timeline" }, this.slider, this.axis()),
      Report.element("div", { class: "controls", role: "group", "aria-label": "Playback" },
        ...buttons, Report.element("label", {}, "speed ", this.speed), ...zoom, ...options),
      this.status,
      Report.element("p", { class: "hint" },
        `● submission, ○ oracle, squares are fixed particles. ${how}, turn the wheel to zoom, click a particle to select it. ` +
        "Keys: space or k play, comma and full stop step, w first wrong step, plus, minus and 0 zoom, arrow keys on the picture ",
        data.dimension === 3 ? "turn it." : "move it."),
      Report.element("div", { class: "particle" }, Report.element("label", {}, "Particle ", this.particle), this.numbers),
    );
  }

  /* The nearest speed at which the motion takes about eight seconds, or real time where that takes 2 to 20 seconds. */
  suggestedSpeed() {
    const duration = (this.data.nStates - 1) * this.data.timeStep;
    if (duration >= 2 && duration <= 20) return 1;
    const wanted = duration / 8;
    return Report.Player.SPEEDS.reduce((best, each) =>
      Math.abs(Math.log(each / wanted)) < Math.abs(Math.log(best / wanted)) ? each : best);
  }

  /* Marks below the slider. The thumb of a slider does not reach its ends. */
  axis() {
    const { firstWrong, horizon, nStates, timeStep } = this.data;
    const axis = Report.element("div", { class: "axis", "aria-hidden": "true" });
    const at = (step, label, kind) => {
      const mark = Report.element("span", { class: `axis-mark ${kind}` }, label);
      const share = this.frameOf(step) / Math.max(1, this.last);
      mark.style.left = `calc(8px + ${share} * (100% - 16px))`;
      mark.classList.toggle("end", share > 0.7);
      axis.append(mark);
    };
    if (firstWrong) at(firstWrong.step, `✗ step ${firstWrong.step}, t = ${Report.short(firstWrong.step * timeStep)} s`, "wrong");
    if (horizon !== null) at(horizon, `prediction horizon, step ${horizon}`, "horizon");
    if (this.data.nGot < this.data.frames.length && this.data.nGot > 0) {
      at(this.data.frames[this.data.nGot - 1], `the trace ends, step ${this.data.frames[this.data.nGot - 1]}`, "ends");
    }
    return axis;
  }

  listen() {
    Report.gestures(this.canvas, {
      drag: (dx, dy, shift) => this.drag(dx, dy, shift),
      zoom: (factor, x, y) => this.zoom(factor, x, y),
      click: (x, y) => this.select(this.view.at(x, y)),
    });
    document.addEventListener("keydown", (event) => this.key(event));
    addEventListener("hashchange", () => {
      const asked = /^#step=(\d+)$/.exec(location.hash);
      if (asked) this.jump(this.frameOf(Number(asked[1])));
    });
  }

  key(event) {
    const always = {
      k: () => this.toggle(),
      " ": () => this.toggle(),
      ",": () => this.step(-1),
      ".": () => this.step(1),
      w: () => this.data.firstWrong && this.jump(this.frameOf(this.data.firstWrong.step)),
      "+": () => this.zoom(1.25),
      "=": () => this.zoom(1.25),
      "-": () => this.zoom(1 / 1.25),
      0: () => this.home(),
    };
    const here = { Home: () => this.jump(0), End: () => this.jump(this.last) };
    for (const [key, [dx, dy]] of Object.entries(Report.arrows)) here[key] = () => this.drag(dx, dy, event.shiftKey);
    Report.key(event, [this.canvas], always, here);
  }

  drag(dx, dy, shift) {
    Report.drag(this.view, this.data.dimension, dx, dy, shift);
    this.draw();
  }

  zoom(factor, x, y) {
    Report.zoom(this.view, factor, x, y);
    this.draw();
  }

  home() {
    this.view.home();
    this.draw();
  }

  /* The last frame at or before a step. */
  frameOf(step) {
    const { frames } = this.data;
    let [low, high] = [0, frames.length - 1];
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (frames[middle] <= step) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  jump(frame) {
    this.pause();
    this.seek(frame);
  }

  step(by) {
    this.jump(this.frame + by);
  }

  seek(frame, share = 0) {
    this.frame = Math.max(0, Math.min(this.last, frame));
    this.share = this.frame === this.last ? 0 : share;
    this.draw();
  }

  select(particle) {
    const count = this.view.count;
    this.view.selected = particle !== null && particle >= 0 && particle < count ? Math.floor(particle) : null;
    this.draw();
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  play() {
    if (this.frame === this.last) this.seek(0);
    this.playing = true;
    this.setPlayButton("❚❚", "Pause");
    let before = null;
    let time = this.time();
    const tick = (now) => {
      if (!this.playing) return;
      if (before !== null) time += ((now - before) / 1000) * Number(this.speed.value);
      before = now;
      const { frames, timeStep } = this.data;
      const frame = this.frameOf(time / timeStep);
      const next = Math.min(frame + 1, this.last);
      const share = next > frame ? (time / timeStep - frames[frame]) / (frames[next] - frames[frame]) : 0;
      this.seek(frame, Math.min(1, Math.max(0, share)));
      if (this.frame === this.last) this.pause();
      else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  pause() {
    if (!this.playing) return;
    this.playing = false;
    this.setPlayButton("▶", "Play");
    this.seek(this.frame);
  }

  setPlayButton(words, label) {
    this.playButton.textContent = words;
    this.playButton.setAttribute("aria-label", label);
    this.playButton.title = `${label} (space or k)`;
  }

  /* Time of the picture, in seconds. */
  time() {
    const { frames, timeStep } = this.data;
    const next = Math.min(this.frame + 1, this.last);
    return timeStep * (frames[this.frame] + this.share * (frames[next] - frames[this.frame]));
  }

  draw() {
    if (!this.view) return;
    const gain = this.view.draw(this.frame, this.share);
    const step = this.data.frames[this.frame];
    this.canvas.dataset.step = step;
    // Text takes longer than the picture.
    const now = performance.now();
    if (this.playing && now - this.told < 100) return;
    this.told = now;
    this.tell(step, gain);
  }

  /* Brings all text and the charts to the step of the picture. */
  tell(step, gain) {
    const { firstWrong, nStates, timeStep } = this.data;
    this.slider.value = this.frame;
    const time = Report.short(step * timeStep, 6);
    this.slider.setAttribute("aria-valuetext", `step ${step}, ${time} seconds`);
    let words = `Step ${step} of ${nStates - 1}, t = ${time} s.`;
    if (!this.view.hasGot(this.frame)) words += " The submission has no state here.";
    else if (gain === 1) words += " Differences to scale.";
    else if (gain !== null) words += ` Differences magnified ${Report.short(gain, 3)} times.`;
    if (this.view.longestForce) words += ` The longest arrow of a force is ${Report.short(this.view.longestForce, 3)} N.`;
    if (firstWrong) {
      if (step < firstWrong.step) words += " Within tolerance so far.";
      else if (step === firstWrong.step) words += ` First wrong step: particle ${firstWrong.particle}.`;
    }
    // A reader of the screen hears where the picture stops, not every frame.
    this.status.setAttribute("aria-live", this.playing ? "off" : "polite");
    this.status.textContent = words;
    this.canvas.setAttribute("aria-label", `Motion of the submission over the oracle, step ${step}`);
    for (const chart of this.charts) chart.cursor(this.time());
    if (!this.playing) this.showNumbers(step);
  }

  /* The numbers of the selected particle: exact around the first wrong step, rounded elsewhere. */
  showNumbers(step) {
    const { exact, dimension } = this.data;
    const particle = this.view.selected;
    if (document.activeElement !== this.particle) this.particle.value = particle ?? "";
    if (particle === null) {
      this.numbers.textContent = "Select a particle to see its numbers.";
      return;
    }
    const axes = ["x", "y", "z"].slice(0, dimension);
    const row = exact.steps.indexOf(step);
    const place = exact.particles.indexOf(particle);
    const shown = this.view.hasGot(this.frame);
    let names = [...axes, ...axes.map((axis) => `v${axis}`)];
    let [expected, got] = [null, null];
    const isExact = row >= 0 && place >= 0;
    if (isExact) {
      const of = (rows) => rows[row].slice(2 * dimension * place, 2 * dimension * (place + 1)).map(String);
      [expected, got] = [of(exact.expected), of(exact.got)];
    } else {
      names = axes;
      const values = axes.map((_, axis) => this.view.expected(this.frame, particle, axis));
      expected = values.map((value) => Report.short(value));
      if (shown) got = values.map((value, axis) => Report.short(value + this.view.difference(this.frame, particle, axis)));
    }
    const cell = (text, other) => {
      const element = Report.element("td", {});
      let same = 0;
      while (other && same < text.length && text[same] === other[same]) same++;
      element.append(text.slice(0, same), text === other || !other ? text.slice(same) : Report.element("mark", {}, text.slice(same)));
      return element;
    };
    const line = (label, values, others) => Report.element("tr", {},
      Report.element("th", { scope: "row" }, label), ...values.map((value, i) => cell(value, others?.[i])));
    const head = Report.element("tr", {}, Report.element("th", { scope: "col" }, `step ${step}`),
      ...names.map((name) => Report.element("th", { scope: "col" }, name)));
    const lines = [line("expected", expected, got)];
    if (got) lines.push(line("got", got, expected));
    this.numbers.replaceChildren(
      Report.element("div", { class: "wide", tabindex: 0, role: "region", "aria-label": "Numbers of the particle" },
        Report.element("table", { class: "digits" }, Report.element("thead", {}, head), Report.element("tbody", {}, ...lines))),
      Report.element("p", { class: "hint" }, isExact ? "All digits." : "Rounded for display."),
    );
  }

  /* The whole paths, side by side with the playback: spirals and closed orbits are seen at once. */
  pathsPanel(host) {
    if (this.view.count > Report.View.PATHS) return;
    const canvas = Report.element("canvas", { role: "img", "aria-label": "Paths of all particles, of the submission over the oracle's" });
    host.append(Report.element("figure", { class: "chart paths" },
      Report.element("figcaption", {}, "Paths from the first state to the last: submission solid, oracle dashed"),
      Report.element("div", { class: "stage" }, canvas)));
    // A wrong step says nothing of the whole.
    const view = new Report.View(canvas, { ...this.data, firstWrong: null });
    view.options = { ghost: true, arrows: false, paths: true };
    canvas.dataset.step = this.data.frames[this.last];
    const draw = () => view.draw(this.last, 0);
    new ResizeObserver(() => {
      view.resize();
      draw();
    }).observe(canvas);
    Report.onTheme(() => {
      view.theme();
      draw();
    });
  }

  chart(host, title, yLabel, series, yLog) {
    const { timeStep, nStates, firstWrong, horizon } = this.data;
    const marks = [];
    if (firstWrong) marks.push({ x: firstWrong.step * timeStep, label: "✗ first wrong" });
    if (horizon !== null) marks.push({ x: horizon * timeStep, label: "horizon" });
    this.charts.push(Report.chart(host, {
      title, yLabel, yLog, series, marks,
      xLabel: "t (s)",
      range: [0, Math.max((nStates - 1) * timeStep, timeStep)],
      onSeek: (time) => this.jump(this.frameOf(Math.round(time / timeStep))),
    }));
  }

  residualCharts() {
    const host = document.getElementById("residual-charts");
    if (!host) return;
    ["position", "velocity"].forEach((quantity, number) => {
      const { steps, values, tolerances, envelopes } = this.data.residuals[number];
      const xs = steps.map((step) => step * this.data.timeStep);
      const series = [
        { name: "residual", xs, ys: values, color: "submission", width: 2 },
        { name: "tolerance", xs, ys: tolerances, color: "wrong", dash: "7 4" },
        { name: "correct programs differ by up to", xs, ys: envelopes, color: "oracle", dash: "2 3" },
      ].filter((each) => each.ys.some((value) => value !== null));
      const unit = number ? "m/s" : "m";
      this.chart(host, `Residual of the ${quantity}`, `residual (${unit}), logarithmic`, series, true);
    });
  }

  energyCharts() {
    const host = document.getElementById("energy-charts");
    const { steps, expected, got } = this.data.energies;
    const xs = steps.map((step) => step * this.data.timeStep);
    /* Curves in the frame of the oracle's, and of the submission's up to a step: a run that explodes would flatten all. */
    const within = (columns, until) => {
      const framed = columns.flatMap(([, ys, own]) => [...ys, ...own.filter((value, i) => steps[i] <= until)]);
      const most = Report.Player.BEYOND * framed.reduce((most, value) => (value === null ? most : Math.max(most, Math.abs(value))), 0) || Infinity;
      return columns.flatMap(([name, ys, own, color]) => {
        const inside = own.map((value) => (value !== null && Math.abs(value) <= most ? value : null));
        const leaves = inside.findIndex((value, i) => value !== own[i]);
        const note = leaves < 0 ? "" : `, beyond the frame from t = ${Report.short(xs[leaves])} s`;
        return [
          { name: `${name}, oracle`, xs, ys, color, dash: "5 4" },
          { name: `${name}, submission`, note, xs, ys: inside, color, width: 2 },
        ];
      }).filter((each) => each.ys.some((value) => value !== null));
    };
    const energies = ["kinetic", "potential", "total"].map((name, number) => [name, expected[name], got[name], `c${number + 1}`]);
    this.chart(host, "Energy", "energy (J)", within(energies, -1), false);
    const axes = expected.momentum.map((ys, axis) => ["xyz"[axis], ys, got.momentum[axis], `c${axis + 1}`]);
    // The oracle's momentum may be rounding alone.
    this.chart(host, "Momentum", "momentum (kg m/s)", within(axes, this.data.firstWrong?.step ?? Infinity), false);
  }
};

Report.start = function () {
  const host = document.getElementById("player");
  const data = Report.data("recording");
  if (host && data) Report.player = new Report.Player(host, data);
};
Report.start();
