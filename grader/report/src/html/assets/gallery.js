"use strict";

/* Playback of the scenes of a gallery. The motion of a scene is in a separate script, which is loaded when the scene
 * comes into view. */
Report.motions = {};

Report.Showing = class {
  constructor(host) {
    this.host = host;
    this.frame = 0;
    this.playing = false;
    const name = host.dataset.name;
    this.canvas = Report.element("canvas", { role: "img", "aria-label": `Motion of ${name}` });
    this.button = Report.element("button", { type: "button", "data-action": "play", disabled: true }, "▶ Play");
    this.slider = Report.element("input", { type: "range", min: 0, max: 0, step: 1, value: 0, "aria-label": `Time in ${name}`, disabled: true });
    this.time = Report.element("output", { class: "time" });
    this.button.addEventListener("click", () => (this.playing ? this.pause() : this.play()));
    this.slider.addEventListener("input", () => {
      this.pause();
      this.show(Number(this.slider.value));
    });
    host.append(
      Report.element("div", { class: "stage" }, this.canvas),
      Report.element("div", { class: "controls" }, this.button, this.slider, this.time),
    );
    const seen = new IntersectionObserver((entries) => {
      if (!entries.some((entry) => entry.isIntersecting)) return;
      seen.disconnect();
      this.load();
    }, { rootMargin: "300px" });
    seen.observe(host);
  }

  load() {
    const number = this.host.dataset.motion;
    const script = Report.element("script", { src: `motions/${number}.js` });
    script.addEventListener("load", () => this.open(Report.motions[number]));
    document.head.append(script);
  }

  open(data) {
    this.data = data;
    this.stage = new Report.Stage(this.canvas, data.scene);
    this.numbers = Report.numbers(data.positions);
    this.size = data.scene.count * data.scene.dimension;
    this.positions = new Float64Array(this.size);
    this.slider.max = data.times.length - 1;
    this.slider.disabled = false;
    this.button.disabled = false;
    this.longest = Math.max(0, ...data.scene.trails.map((trail) => trail.duration));
    new ResizeObserver(() => {
      this.stage.resize();
      this.show(this.frame);
    }).observe(this.canvas);
    // A picture from the motion, where there is one.
    this.show(Math.floor(0.55 * (data.times.length - 1)));
  }

  /* The positions of a frame, or of a time between it and the next one. */
  place(frame, share = 0) {
    const { low, unit, scene, times } = this.data;
    const next = Math.min(frame + 1, times.length - 1);
    for (let at = 0; at < this.size; at++) {
      const [a, b] = [this.numbers[frame * this.size + at], this.numbers[next * this.size + at]];
      this.positions[at] = low[at % scene.dimension] + unit * (a + share * (b - a));
    }
    return this.positions;
  }

  show(frame, share = 0) {
    const { times } = this.data;
    this.frame = frame;
    this.stage.reset();
    if (this.longest > 0) {
      let first = frame;
      while (first > 0 && times[frame] - times[first] < this.longest) first--;
      for (let each = first; each <= frame; each++) this.stage.follow(times[each], this.place(each));
    }
    const next = Math.min(frame + 1, times.length - 1);
    const time = times[frame] + share * (times[next] - times[frame]);
    this.stage.draw(time, this.place(frame, share));
    this.slider.value = frame;
    this.canvas.dataset.frame = frame;
    this.time.textContent = `${time.toFixed(2)} s`;
  }

  play() {
    const { times } = this.data;
    const last = times.length - 1;
    this.playing = true;
    this.button.textContent = "❚❚ Pause";
    let time = this.frame >= last ? 0 : times[this.frame];
    let before = null;
    const tick = (now) => {
      if (!this.playing) return;
      if (before !== null) time += (now - before) / 1000;
      before = now;
      let frame = time < times[this.frame] ? 0 : this.frame;
      while (frame < last && times[frame + 1] <= time) frame++;
      const share = frame < last ? Math.min(1, (time - times[frame]) / (times[frame + 1] - times[frame])) : 0;
      this.show(frame, share);
      if (frame === last) this.pause();
      else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  pause() {
    this.playing = false;
    this.button.textContent = "▶ Play";
  }
};

for (const host of document.querySelectorAll("[data-motion]")) new Report.Showing(host);
