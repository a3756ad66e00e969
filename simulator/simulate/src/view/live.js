"use strict";

/* A scene that runs live: asks for a frame, draws it, and asks for the next one. All numbers come from the simulator; the page
 * draws them and counts frames. */

/* One run: its integrator and time step, its picture and what is said of it. */
Report.Pane = class {
  constructor(live, settings, integrators, number) {
    this.live = live;
    this.integrator = settings.integrator;
    this.timeStep = settings.timeStep;
    this.number = number;
    this.select = Report.element("select", { "aria-label": "Integrator", name: "integrator" },
      ...integrators.map((name) => Report.element("option", { value: name }, name)));
    this.select.value = this.integrator;
    this.select.addEventListener("change", () => {
      this.integrator = this.select.value;
      live.change();
    });
    const step = live.number("timeStep", "h (s)", this.timeStep, { min: 0, class: "time-step" }, (value) => {
      this.timeStep = value;
      live.change();
    });
    this.canvas = Report.element("canvas", { tabindex: 0, role: "img", "aria-label": `Motion of run ${number}` });
    this.verdict = Report.element("p", { class: "verdict bad", role: "status", hidden: true });
    this.status = Report.element("output", { class: "status" });
    this.element = Report.element("section", { class: "pane", "aria-label": `Run ${number}` },
      Report.element("div", { class: "controls" }, this.select, step),
      Report.element("div", { class: "stage" }, this.canvas), this.verdict, this.status);
    this.begin();
  }

  /* Forgets what is drawn over time. */
  begin() {
    this.history = { times: [], kinetic: [], potential: [] };
    this.forget();
    this.stage?.reset();
  }

  /* Forgets how fast the run was. */
  forget() {
    this.window = [];
    this.unended = { wall: 0, seconds: 0, late: 0 };
  }

  open(scene, positions, view) {
    this.stage = new Report.Stage(this.canvas, scene, this.live.data.strain);
    if (view) Object.assign(this.stage, { zoom: view.zoom, pan: [...view.pan], turn: [...view.turn] });
    Object.assign(this.stage.options, this.live.shown);
    this.positions = positions;
    this.observer = new ResizeObserver(() => {
      this.stage.resize();
      this.draw();
    });
    this.observer.observe(this.canvas);
    const grab = (x, y) => this.live.grab(this, x, y);
    const drag = (dx, dy, shift) => this.live.look((stage) => Report.drag(stage, scene.dimension, dx, dy, shift));
    const zoom = (factor, x, y) => this.live.look((stage) => Report.zoom(stage, factor, x, y));
    Report.gestures(this.canvas, { grab, drag, zoom });
  }

  close() {
    this.observer.disconnect();
    this.element.remove();
  }

  /* Takes a frame; `wall` are the seconds since the one before. */
  take(status, positions, wall, seconds) {
    this.state = status;
    this.positions = positions;
    const { time, kinetic, potential } = status;
    const { times } = this.history;
    if (status.steps > 0) this.stage.follow(time, positions);
    if (status.steps > 0 || (!times.length && !status.underway)) {
      const last = times.length - 1;
      // A new time step may continue a little earlier.
      if (last >= 0 && time <= times[last]) for (const list of Object.values(this.history)) list.pop();
      times.push(time);
      this.history.kinetic.push(kinetic);
      this.history.potential.push(potential);
      if (times.length > Report.Live.HISTORY) for (const list of Object.values(this.history)) list.shift();
    }
    // Frames that wait for a step count together with the one that shows it.
    const { unended } = this;
    unended.wall += wall;
    unended.seconds += seconds;
    unended.late += status.late;
    if (!status.underway) {
      if (unended.seconds > 0) this.window.push({ at: performance.now(), ...status, ...unended });
      this.unended = { wall: 0, seconds: 0, late: 0 };
    }
    const oldest = performance.now() - 1000 * Math.max(2, Math.min(10, 4 * this.timeStep));
    while (this.window.length > 2 && this.window[0].at < oldest) this.window.shift();
  }

  draw() {
    if (!this.stage) return;
    this.stage.draw(this.state?.time ?? 0, this.positions);
    const { held } = this.live;
    this.canvas.dataset.step = this.state?.step ?? 0;
    if (held === null) return;
    const { context, screen } = this.stage;
    context.strokeStyle = Report.color("wrong");
    context.lineWidth = 2;
    context.beginPath();
    context.arc(screen[4 * held.particle], screen[4 * held.particle + 1], 12, 0, 2 * Math.PI);
    context.stroke();
  }

  /* Sum of a quantity over the frames of the last seconds. */
  sum(of) {
    return this.window.reduce((sum, frame) => sum + of(frame), 0);
  }

  /* How fast the run is: null while too little is known. */
  speed() {
    const [wall, seconds] = [this.sum((frame) => frame.wall), this.sum((frame) => frame.seconds)];
    if (wall < 0.5 || !this.live.playing || this.state.failure) return null;
    const steps = this.sum((frame) => frame.steps);
    return {
      rate: this.sum((frame) => frame.simulated) / wall,
      late: this.sum((frame) => frame.late) / seconds,
      perStep: steps ? this.sum((frame) => frame.computing) / steps : null,
      frames: this.window.length / wall,
    };
  }

  tell() {
    const { state } = this;
    if (!state) return;
    const joules = (value) => `${Report.short(value).replace("-", "−")}\u00a0J`;
    const { kinetic, potential, underway } = state;
    const isKnown = kinetic !== null && potential !== null;
    const energy = isKnown ? `Energy ${joules(kinetic + potential)}: kinetic ${joules(kinetic)}, potential ${joules(potential)}. ` : "";
    const words = [`Step ${state.step}, t = ${Report.short(state.time, 6)}\u00a0s. `, energy || (underway ? "" : "The energy is not finite. ")];
    if (underway?.seconds >= 1) {
      const seconds = `${Math.floor(underway.seconds)}\u00a0s`;
      words.push(Report.element("strong", { class: "slow" }, underway.abandoned
        ? `The abandoned step has not ended yet (${seconds}); this run continues when it has. `
        : `The next step has taken ${seconds} so far. Reset, or change a setting, to abandon it. `));
    }
    const speed = this.speed();
    if (speed) {
      const step = speed.perStep === null ? "" : ` A step takes ${Report.short(1000 * speed.perStep, 2)} ms.`;
      const count = Math.round(speed.frames);
      const frames = ` ${count} ${count === 1 ? "frame" : "frames"} a second.`;
      const asked = this.live.speed();
      const times = (rate) => (rate === 1 ? "real time" : `${Report.short(rate, 2)}\u00a0× real time`);
      if (speed.late > 0.03) {
        const factor = Report.short(asked / speed.rate, 2);
        words.push(Report.element("strong", { class: "slow" },
          `Too slow for ${times(asked)}: runs at ${times(speed.rate)}, ${factor} times slower than asked.`), step, frames);
      } else words.push(`Runs at ${Report.short(speed.rate, 2)}\u00a0× real time.`, step, frames);
      this.canvas.dataset.fps = speed.frames.toFixed(1);
    }
    // A reader of the screen hears where the run stops, not every frame.
    this.status.setAttribute("aria-live", this.live.playing ? "off" : "polite");
    this.status.replaceChildren(...words);
    this.judge(state);
  }

  /* Says why the run stands still. */
  judge({ failure, time, step }) {
    const at = `at t = ${Report.short(time, 6)} s, after step ${step}`;
    const texts = {
      "blew-up": () => `Blew up ${at}: ${failure.message}. Reset, or change the settings (${failure.help}).`,
      failed: () => `Stopped ${at}: ${failure.message}. Reset, or change the settings (${failure.help}).`,
      refused: () => `Cannot run: ${failure.message}. Help: ${failure.help}.`,
    };
    const text = failure ? texts[failure.kind]() : "";
    this.verdict.hidden = !failure;
    if (this.verdict.textContent !== text) this.verdict.textContent = text;
  }

  /* The largest kinetic or potential energy that is kept. */
  largest() {
    const { kinetic, potential } = this.history;
    return [...kinetic, ...potential].reduce((most, value) => (value === null ? most : Math.max(most, Math.abs(value))), 0);
  }

  /* Lines of the diagram: the total of each of two runs up to a limit, or all of a run that is alone. */
  series(alone, limit) {
    const { times, kinetic, potential } = this.history;
    const bounded = (value) => (value !== null && Math.abs(value) < 1e300 ? value : null);
    const total = kinetic.map((value, i) => (value === null || potential[i] === null ? null : bounded(value + potential[i])));
    const line = (name, ys, color, rest) => ({ name, xs: [...times], ys, color, ...rest });
    if (!alone) {
      const inside = total.map((value) => (value !== null && Math.abs(value) <= limit ? value : null));
      const leaves = inside.at(-1) === null ? ", beyond the frame" : "";
      const dash = this.number === 1 ? null : "7 4";
      return [line(`total, ${this.integrator} (run ${this.number})${leaves}`, inside, `c${this.number}`, { width: 2, dash })];
    }
    return [
      line("kinetic", kinetic.map(bounded), "c1", { dash: "5 3" }),
      line("potential", potential.map(bounded), "c2", { dash: "2 3" }),
      line(`total, ${this.integrator}`, total, "c3", { width: 2 }),
    ];
  }

  marks() {
    const { failure, time } = this.state ?? {};
    return failure?.kind === "blew-up" ? [{ x: time, label: "✗ blew up" }] : [];
  }
};

Report.Live = class {
  static SPEEDS = [0.05, 0.1, 0.25, 0.5, 1, 2, 5, 10];
  /* Frames whose energies are kept. */
  static HISTORY = 1200;
  /* A line ends where it is this many times the energies of the other run. */
  static BEYOND = 10;
  /* Longest time between two frames that the run makes up for, in seconds. */
  static LONGEST = 0.25;

  /* `ask(request)` yields the bytes of a frame. */
  constructor(host, data, ask) {
    this.data = data;
    this.answer = ask;
    this.session = data.session;
    this.playing = false;
    this.held = null;
    this.shown = { edges: true, particles: true, faces: true, strain: false };
    this.common = { mass: 1, stiffness: 1, damping: 0, modulus: data.settings.modulus, poisson: data.settings.poisson };
    this.windy = data.settings.wind !== 0;
    this.strength = data.settings.wind || 1;
    this.pending = { reset: false, step: false };
    this.changed = true;
    this.waiting = false;
    this.missed = false;
    this.fresh = false;
    this.told = 0;
    this.panes = [];
    this.build(host);
    this.add();
    this.closing = new AbortController();
    const { signal } = this.closing;
    document.addEventListener("keydown", (event) => this.key(event), { signal });
    document.addEventListener("visibilitychange", () => this.pause(true), { signal });
    requestAnimationFrame((now) => this.tick(now));
  }

  /* Leaves the page to another scene. */
  close() {
    this.ended = true;
    this.closing.abort();
    for (const pane of this.panes) pane.close();
    this.host.remove();
  }

  /* A field for a number, with buttons that halve and double it. */
  number(name, label, value, attributes, set) {
    const input = Report.element("input", { type: "number", name, step: "any", value, required: true, ...attributes });
    const refused = Report.element("output", { class: "refused" });
    const take = () => {
      const fits = input.checkValidity();
      input.setAttribute("aria-invalid", !fits);
      refused.textContent = fits ? "" : `${label.replace(/ [^ ]*$/, "")} must be a number${"min" in attributes ? ", 0 or more" : ""}; the last one stays.`;
      if (fits) set(Number(input.value));
    };
    input.addEventListener("change", take);
    const times = (factor, words) => {
      const button = Report.element("button", { type: "button", "aria-label": `${words} ${label}` }, words);
      button.addEventListener("click", () => {
        input.value = Number((Number(input.value) * factor).toPrecision(12));
        take();
      });
      return button;
    };
    const buttons = value === 0 ? [] : [times(0.5, "÷2"), times(2, "×2")];
    return Report.element("fieldset", {}, Report.element("label", {}, label, " ", input), ...buttons, refused);
  }

  build(host) {
    const button = (name, words, label, key, action) => {
      const element = Report.element("button", { type: "button", "data-action": name, title: `${label} (${key})`, "aria-label": label, "aria-keyshortcuts": key }, words);
      element.addEventListener("click", action);
      return element;
    };
    const box = (name, label, checked, set) => {
      const input = Report.element("input", { type: "checkbox", name, checked });
      input.addEventListener("change", () => set(input.checked));
      return Report.element("label", {}, input, label);
    };
    this.playButton = button("play", "▶ Play", "Play", "k", () => this.toggle());
    this.speeds = Report.element("select", { "aria-label": "Speed" },
      ...Report.Live.SPEEDS.map((speed) => Report.element("option", { value: speed, selected: speed === 1 }, `${speed} ×`)));
    this.speeds.addEventListener("change", () => this.forget());
    const show = (name) => (checked) => {
      this.shown[name] = checked;
      this.look((stage) => Object.assign(stage.options, this.shown));
    };
    const playback = [
      this.playButton,
      button("step", "+1", "+1 step", ".", () => this.step()),
      button("reset", "↺ Reset", "Reset", "r", () => this.reset()),
      Report.element("label", {}, "speed ", this.speeds),
      button("out", "−", "Zoom out", "-", () => this.zoom(1 / 1.25)),
      button("in", "+", "Zoom in", "+", () => this.zoom(1.25)),
      button("home", "Fit", "Fit the picture", "0", () => this.look((stage) => stage.home())),
      box("edges", "edges", true, show("edges")),
      box("masses", "masses", true, show("particles")),
      ...(this.data.scene.faces ? [box("faces", "faces", true, show("faces"))] : []),
      ...(this.data.strain ? [box("strain", "strain", false, show("strain"))] : []),
    ];
    const set = (name) => (value) => {
      this.common[name] = value;
      this.change();
    };
    const physics = [
      this.number("mass", "mass ×", 1, { min: 0 }, set("mass")),
      this.number("stiffness", "stiffness ×", 1, { min: 0 }, set("stiffness")),
      this.number("damping", "damping +", 0, { min: 0 }, set("damping")),
      ...(this.common.modulus === null ? [] : [this.number("modulus", "modulus ×", 1, { min: 0 }, set("modulus"))]),
      ...(this.common.poisson === null ? [] : [this.number("poisson", "ν", this.common.poisson, {}, set("poisson"))]),
      Report.element("fieldset", {}, box("wind", "wind, strength", this.windy, (checked) => {
        this.windy = checked;
        this.change();
      }), this.wind()),
      box("second", "second integrator", false, (checked) => (checked ? this.add() : this.remove())),
    ];
    const group = (label, content) => Report.element("div", { class: "controls", role: "group", "aria-label": label }, ...content);
    this.panesHost = Report.element("div", { class: "panes" });
    this.charts = Report.element("div", { class: "charts" });
    const how = this.data.scene.dimension === 3 ? "turn it, with Shift to move it" : "move it";
    this.host = Report.element("div", { class: "live single" },
      Report.element("div", { class: "wide-row" }, group("Playback", playback), group("Settings of all particles and springs", physics)),
      this.panesHost, this.charts,
      Report.element("p", { class: "hint wide-row" },
        `Squares are fixed particles. Drag a particle to move it; drag the picture to ${how}; turn the wheel to zoom. Keys: space or k play, full stop step, r reset, ` +
        `w wind, e edges, m masses, ${this.data.scene.faces ? "f faces, " : ""}${this.data.strain ? "s strain, " : ""}2 second integrator, plus, minus and 0 zoom, arrow keys on the picture. ` +
        "Mass is a factor of every particle's; stiffness is a factor, damping is added, of every spring; modulus is a factor of every elastic body's."));
    host.append(this.host);
    this.chart = Report.chart(this.charts, { title: "Energy", xLabel: "t (s)", yLabel: "energy (J)", series: [] });
  }

  wind() {
    const input = Report.element("input", { type: "number", name: "strength", step: "any", value: this.strength, required: true, "aria-label": "Strength of the wind" });
    input.addEventListener("change", () => {
      if (!input.checkValidity()) return;
      this.strength = Number(input.value);
      this.change();
    });
    return input;
  }

  /* Adds a run that continues from the state of the first one. */
  add() {
    const [first] = this.panes;
    const settings = first ? { integrator: this.other(first.integrator), timeStep: first.timeStep } : this.data.settings;
    const pane = new Report.Pane(this, settings, this.data.integrators, this.panes.length + 1);
    this.panes.push(pane);
    this.panesHost.append(pane.element);
    pane.open(this.data.scene, first ? first.positions : Float64Array.from(this.data.positions), first?.stage);
    this.arrange();
  }

  remove() {
    this.panes.pop().close();
    this.arrange();
  }

  /* An integrator to compare with. */
  other(name) {
    return ["implicit-euler", "explicit-euler"].find((each) => each !== name);
  }

  arrange() {
    this.host.classList.toggle("single", this.panes.length === 1);
    for (const pane of this.panes) pane.begin();
    this.change();
  }

  speed() {
    return Number(this.speeds.value);
  }

  change() {
    this.changed = true;
    this.forget();
  }

  /* Forgets how fast the runs were. */
  forget() {
    for (const pane of this.panes) pane.forget();
  }

  look(change) {
    for (const pane of this.panes) {
      change(pane.stage);
      pane.draw();
    }
  }

  zoom(factor, x, y) {
    this.look((stage) => Report.zoom(stage, factor, x, y));
  }

  /* Takes hold of a particle near a place. */
  grab(pane, x, y) {
    const particle = pane.stage.at(x, y, 16);
    if (particle === null) return null;
    const at = pane.stage.point(pane.positions, particle);
    const move = (x, y) => {
      const position = pane.stage.unproject(x, y, at);
      if (!position.every(Number.isFinite)) return;
      this.held = { particle, position };
      this.changed = true;
    };
    move(x, y);
    return {
      move,
      end: () => {
        this.held = null;
        this.changed = true;
      },
    };
  }

  key(event) {
    const click = (name) => () => this.host.querySelector(`input[name=${name}]`)?.click();
    const always = {
      k: () => this.toggle(),
      " ": () => this.toggle(),
      ".": () => this.step(),
      r: () => this.reset(),
      w: click("wind"),
      e: click("edges"),
      m: click("masses"),
      f: click("faces"),
      s: click("strain"),
      2: click("second"),
      "+": () => this.zoom(1.25),
      "=": () => this.zoom(1.25),
      "-": () => this.zoom(1 / 1.25),
      0: () => this.look((stage) => stage.home()),
    };
    const here = {};
    for (const [key, [dx, dy]] of Object.entries(Report.arrows)) {
      here[key] = () => this.look((stage) => Report.drag(stage, this.data.scene.dimension, dx, dy, event.shiftKey));
    }
    Report.key(event, this.panes.map((pane) => pane.canvas), always, here);
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  play() {
    this.playing = true;
    this.before = null;
    this.forget();
    this.label("❚❚ Pause", "Pause");
  }

  /* Stops; a page that is out of sight goes on where it was when it is seen again. */
  pause(stays = false) {
    this.before = null;
    this.forget();
    if (stays) return;
    this.playing = false;
    this.changed = true;
    this.label("▶ Play", "Play");
  }

  label(words, label) {
    this.playButton.textContent = words;
    this.playButton.setAttribute("aria-label", label);
    this.playButton.title = `${label} (space or k)`;
  }

  step() {
    if (this.playing) this.pause();
    this.pending.step = true;
    this.changed = true;
  }

  reset() {
    this.pending.reset = true;
    this.change();
  }

  /* Before each picture: asks for the next frame, which is computed while the last one is drawn. */
  tick(now) {
    if (this.closing.signal.aborted) return;
    requestAnimationFrame((next) => this.tick(next));
    if (this.waiting) this.missed = true;
    else this.ask(now);
    if (!this.fresh) return;
    this.fresh = false;
    for (const pane of this.panes) pane.draw();
    this.tell();
  }

  /* Asks for the next frame, if anything moves, changed, or has not ended. */
  ask(now) {
    this.missed = false;
    if (this.ended || !(this.playing || this.changed || this.panes.some((pane) => pane.state?.underway))) return;
    // The time of a picture may lie before that of the last request.
    const wall = this.before === null ? 1 / 60 : Math.max(0, now - this.before) / 1000;
    this.before = now;
    const { reset, step } = this.pending;
    const seconds = this.playing && !reset ? Math.min(wall, Report.Live.LONGEST) * this.speed() : 0;
    this.pending = { reset: false, step: false };
    this.changed = false;
    const wind = this.windy ? this.strength : 0;
    const settings = this.panes.map(({ integrator, timeStep }) => ({ integrator, timeStep, wind, ...this.common }));
    this.frame({ session: this.session, reset, step, seconds, hold: this.held, settings }, wall);
  }

  async frame(request, wall) {
    this.waiting = true;
    try {
      const bytes = await this.answer(request);
      if (this.closing.signal.aborted) return;
      const length = new DataView(bytes).getUint32(0, true);
      const statuses = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 8, length)));
      const count = this.data.scene.count * this.data.scene.dimension;
      if (request.reset) for (const pane of this.panes) pane.begin();
      statuses.forEach((status, number) => {
        const positions = new Float64Array(bytes, 8 + length + 8 * count * number, count);
        this.panes[number]?.take(status, positions, wall, request.seconds);
      });
      this.fresh = true;
    } catch (error) {
      if (this.closing.signal.aborted) return;
      this.ended = true;
      Report.end(error);
    }
    this.waiting = false;
    // A frame that came too late for a picture is followed by the next one at once.
    if (this.missed) this.ask(performance.now());
  }

  /* Brings text and diagram up to date; they take longer than the picture. */
  tell() {
    const now = performance.now();
    if (this.playing && now - this.told < 100) return;
    this.told = now;
    for (const pane of this.panes) pane.tell();
    const alone = this.panes.length === 1;
    // A run that blows up leaves the diagram of the other one.
    const limit = Report.Live.BEYOND * Math.min(...this.panes.map((pane) => pane.largest()));
    this.chart.update({
      series: this.panes.flatMap((pane) => pane.series(alone, limit)),
      marks: this.panes.flatMap((pane) => pane.marks()),
    });
  }
};
