"use strict";

/* Line charts as vector graphics, with a readout at the pointer or at the cursor.
 *
 * Report.chart(host, {
 *   title, xLabel, yLabel,
 *   xLog, yLog,                     logarithmic axes; values that are not positive stand at the lower edge
 *   range: [from, to],              of x; by default that of the data
 *   series: [{name, note, xs, ys, color, dash, width, marker}],    null in ys is a gap; the legend adds the note
 *   marks: [{x, label}],            vertical lines
 *   onSeek(x),                      called for a click
 * })
 * returns {cursor(x), update({series, marks})}: moves the cursor, or shows other numbers. */
Report.chart = function (host, options) {
  let { series, marks = [] } = options;
  const margin = { left: 68, right: 14, top: 14, bottom: 40 };
  const height = options.height ?? 250;
  const drawing = Report.svg("svg", { class: "drawing", role: "img" });
  const readout = Report.element("p", { class: "readout" }, "\u00a0");
  const legend = Report.element("ul", { class: "legend" });
  const details = Report.element("details", {}, Report.element("summary", {}, `Numbers of “${options.title}”`));
  details.addEventListener("toggle", () => details.open && tabulate());
  const figure = Report.element(
    "figure", { class: "chart" },
    Report.element("figcaption", {}, options.title), drawing, legend, readout, details,
  );
  host.append(figure);

  let [all, xRange, yRange] = [[], [0, 1], [0, 1]];
  let scale = null;
  let cursorAt = null;
  let cursorLine = null;
  let hovered = false;

  /* Takes the numbers: their ranges, and the names of the lines. */
  function take() {
    all = series.flatMap((each) => each.ys.filter((y) => y !== null));
    yRange = yExtent();
    const xs = series.flatMap((each) => each.xs);
    xRange = options.range ?? extent(xs.length ? xs : [0, 1], options.xLog, 0.02);
    drawing.setAttribute("aria-label", summary());
    const names = series.map((each) => each.name).join("\n");
    if (legend.dataset.names !== names) {
      legend.dataset.names = names;
      legend.replaceChildren(...series.map((each) => Report.element("li", {}, sample(each), each.name + (each.note ?? ""))));
    }
  }

  function positive(values) {
    return values.filter((value) => value > 0);
  }

  function extent(values, log, space) {
    const known = log ? positive(values).map(Math.log10) : values;
    let low = known.reduce((least, value) => Math.min(least, value), Infinity);
    let high = known.reduce((most, value) => Math.max(most, value), -Infinity);
    if (!(low <= high)) [low, high] = log ? [-1, 0] : [0, 1];
    if (high - low < 1e-12 * Math.max(Math.abs(low), Math.abs(high), 1e-300)) {
      const half = log ? 0.5 : Math.abs(high) * 0.1 || 1;
      [low, high] = [low - half, high + half];
    }
    const free = (high - low) * space;
    return log ? [10 ** (low - free), 10 ** (high + free)] : [low - free, high + free];
  }

  function yExtent() {
    if (!options.yLog) return extent(all.length ? all : [0, 1], false, 0.08);
    const known = positive(all);
    if (!known.length) return [1e-17, 1e-15];
    const low = Math.floor(Math.log10(Math.min(...known)));
    const high = Math.ceil(Math.log10(Math.max(...known)));
    // Room below for zeros.
    return [10 ** (low - (all.length > known.length ? 1 : 0)), 10 ** Math.max(high, low + 1)];
  }

  function summary() {
    const names = series.map((each) => each.name).join(", ");
    const found = marks.map((mark) => mark.label).join("; ");
    return `${options.title}: ${names}, over ${options.xLabel}.${found ? ` Marked: ${found}.` : ""} The table below has the numbers.`;
  }

  function sample(each) {
    const icon = Report.svg("svg", { width: 28, height: 12, viewBox: "0 0 28 12", "aria-hidden": "true" });
    icon.append(Report.svg("line", { x1: 1, x2: 27, y1: 6, y2: 6, ...stroke(each) }));
    if (each.marker !== undefined) icon.append(marker(each, 14, 6));
    return icon;
  }

  function stroke(each) {
    return {
      class: `stroke-${each.color}`,
      fill: "none",
      "stroke-width": each.width ?? 1.75,
      "stroke-dasharray": each.dash ?? null,
    };
  }

  function marker(each, x, y) {
    const shapes = [
      "M-3.5 0a3.5 3.5 0 1 0 7 0a3.5 3.5 0 1 0 -7 0", "M0 -4.5L4.2 3.5L-4.2 3.5Z", "M-3.2 -3.2H3.2V3.2H-3.2Z",
      "M0 -4.8L4.8 0L0 4.8L-4.8 0Z", "M0 4.5L4.2 -3.5L-4.2 -3.5Z",
      "M0 -6L1.5 -1.5L6 0L1.5 1.5L0 6L-1.5 1.5L-6 0L-1.5 -1.5Z", "M-4.2 -1.6L0 -4.8L4.2 -1.6L2.7 3.6H-2.7Z",
    ];
    const shape = shapes[each.marker % shapes.length];
    return Report.svg("path", {
      d: shape, transform: `translate(${x} ${y})`, "stroke-width": 1.6,
      class: `stroke-${each.color} ${each.open ? "hollow" : `fill-${each.color}`}`,
    });
  }

  /* The numbers, of the moment when they are opened. */
  function tabulate() {
    const places = [...new Set(series.flatMap((each) => each.xs))].sort((a, b) => a - b);
    const columns = series.map((each) => new Map(each.xs.map((x, i) => [x, each.ys[i]])));
    const head = [options.xLabel, ...series.map((each) => each.name)];
    const rows = places.map((x) => [Report.short(x, 6), ...columns.map((column) => Report.short(column.get(x)))]);
    details.querySelector("div")?.remove();
    details.append(Report.element(
      "div", { class: "wide", tabindex: 0, role: "region", "aria-label": `Numbers of ${options.title}` },
      Report.element(
        "table", {},
        Report.element("thead", {}, Report.element("tr", {}, ...head.map((name) => Report.element("th", { scope: "col" }, name)))),
        Report.element("tbody", {}, ...rows.map((row) =>
          Report.element("tr", {}, ...row.map((text) => Report.element("td", { class: "number" }, text))))),
      ),
    ));
  }

  function ticks([low, high], log, most) {
    if (log) {
      const [from, to] = [Math.ceil(Math.log10(low) - 1e-9), Math.floor(Math.log10(high) + 1e-9)];
      const step = Math.max(1, Math.ceil((to - from + 1) / most));
      const found = [];
      for (let power = to; power >= from; power -= step) found.push(10 ** power);
      return found;
    }
    const rough = (high - low) / most;
    const unit = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((factor) => factor * unit).find((each) => each >= rough);
    const found = [];
    for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step; k++) found.push(k * step);
    return found;
  }

  /* The text of a tick; sums of steps that are zero but for rounding, relative to the range of the axis, are zero. */
  function label(value, [low, high], log) {
    if (!log) return Report.short(Math.abs(value) < 1e-12 * (high - low) ? 0 : value, 5).replace("-", "−");
    const power = Math.round(Math.log10(value));
    return power >= -2 && power <= 3 ? String(10 ** power).slice(0, 6) : `1e${power}`.replace("-", "−");
  }

  function draw() {
    const width = Math.max(figure.clientWidth, 240);
    const inner = { width: width - margin.left - margin.right, height: height - margin.top - margin.bottom };
    const map = (value, [low, high], log, from, to) => {
      const [a, b, c] = log ? [value, low, high].map((each) => Math.log10(Math.max(each, 1e-320))) : [value, low, high];
      return from + ((a - b) / (c - b)) * (to - from);
    };
    scale = {
      x: (value) => map(value, xRange, options.xLog, margin.left, margin.left + inner.width),
      y: (value) => map(Math.max(value, options.yLog ? yRange[0] : -Infinity), yRange, options.yLog,
        margin.top + inner.height, margin.top),
      inverse: (pixel) => {
        const share = Math.min(1, Math.max(0, (pixel - margin.left) / inner.width));
        if (!options.xLog) return xRange[0] + share * (xRange[1] - xRange[0]);
        const [low, high] = xRange.map(Math.log10);
        return 10 ** (low + share * (high - low));
      },
    };
    const parts = [];
    const bottom = margin.top + inner.height;
    const text = (attributes, content) => Report.svg("text", attributes, content);
    // Values that are not positive stand at the lower edge.
    const zeros = options.yLog && all.some((value) => value <= 0);
    for (const value of ticks(yRange, options.yLog, 6)) {
      const y = scale.y(value);
      if (zeros && y > bottom - 12) continue;
      parts.push(Report.svg("line", { class: "grid", x1: margin.left, x2: margin.left + inner.width, y1: y, y2: y }));
      parts.push(text({ x: margin.left - 7, y: y + 4, "text-anchor": "end" }, label(value, yRange, options.yLog)));
    }
    if (zeros) {
      parts.push(text({ x: margin.left - 7, y: bottom + 4, "text-anchor": "end" }, "0"));
    }
    for (const value of ticks(xRange, options.xLog, Math.max(3, Math.floor(inner.width / 90)))) {
      const x = scale.x(value);
      parts.push(Report.svg("line", { class: "grid", x1: x, x2: x, y1: margin.top, y2: bottom }));
      parts.push(text({ x, y: bottom + 16, "text-anchor": "middle" }, label(value, xRange, options.xLog)));
    }
    parts.push(Report.svg("rect", { class: "frame", x: margin.left, y: margin.top, width: inner.width, height: inner.height }));
    parts.push(text({ x: margin.left + inner.width / 2, y: height - 6, "text-anchor": "middle" }, options.xLabel));
    parts.push(text({
      transform: `translate(13 ${margin.top + inner.height / 2}) rotate(-90)`, "text-anchor": "middle",
    }, options.yLabel));
    const labels = marks.map((mark) => {
      const x = scale.x(mark.x);
      parts.push(Report.svg("line", { class: "mark", x1: x, x2: x, y1: margin.top, y2: bottom }));
      const end = x > margin.left + inner.width * 0.6;
      return text({ class: "mark-label", x: x + (end ? -5 : 5), y: margin.top + 12, "text-anchor": end ? "end" : "start" }, mark.label);
    });
    for (const each of series) {
      parts.push(Report.svg("path", { d: path(each), "stroke-linejoin": "round", ...stroke(each) }));
      if (each.marker !== undefined) {
        each.xs.forEach((x, i) => {
          if (each.ys[i] !== null) parts.push(marker(each, scale.x(x), scale.y(each.ys[i])));
        });
      }
    }
    cursorLine = Report.svg("line", { class: "cursor", y1: margin.top, y2: bottom, visibility: "hidden" });
    parts.push(...labels, cursorLine);
    drawing.setAttribute("viewBox", `0 0 ${width} ${height}`);
    drawing.setAttribute("width", width);
    drawing.setAttribute("height", height);
    drawing.replaceChildren(...parts);
    if (cursorAt !== null) showAt(cursorAt);
  }

  function path(each) {
    let commands = "";
    let pen = "M";
    each.xs.forEach((x, i) => {
      if (each.ys[i] === null) {
        pen = "M";
        return;
      }
      commands += `${pen}${scale.x(x).toFixed(1)} ${scale.y(each.ys[i]).toFixed(1)}`;
      pen = "L";
    });
    return commands;
  }

  /* The last point at or before x; the nearest one on an axis of time steps. */
  function nearest(each, x) {
    let best = -1;
    let distance = Infinity;
    each.xs.forEach((other, i) => {
      const apart = options.xLog ? Math.abs(Math.log(other / x)) : Math.abs(other - x);
      if (each.ys[i] !== null && apart < distance) [best, distance] = [i, apart];
    });
    return best;
  }

  function showAt(x) {
    if (!scale) return;
    const at = scale.x(x);
    cursorLine.setAttribute("x1", at);
    cursorLine.setAttribute("x2", at);
    cursorLine.setAttribute("visibility", "visible");
    const values = series.map((each) => {
      const i = nearest(each, x);
      return `${each.name} ${i < 0 ? "–" : Report.short(each.ys[i])}`;
    });
    readout.textContent = `${options.xLabel.replace(/ .*/, "")} ${Report.short(x)}: ${values.join(", ")}`;
  }

  const place = (event) => {
    const box = drawing.getBoundingClientRect();
    return scale.inverse(event.clientX - box.left);
  };
  drawing.addEventListener("pointermove", (event) => {
    hovered = true;
    showAt(place(event));
  });
  drawing.addEventListener("pointerleave", () => {
    hovered = false;
    if (cursorAt === null) cursorLine.setAttribute("visibility", "hidden");
    else showAt(cursorAt);
  });
  if (options.onSeek) drawing.addEventListener("click", (event) => options.onSeek(place(event)));
  new ResizeObserver(draw).observe(figure);
  take();
  draw();
  return {
    update(numbers) {
      ({ series, marks = [] } = numbers);
      take();
      draw();
    },
    cursor(x) {
      cursorAt = x;
      if (!hovered) showAt(x);
    },
  };
};

/* Charts of the pages that have no playback: their options are data. */
for (const host of document.querySelectorAll("[data-chart]")) {
  Report.chart(host, Report.data(host.dataset.chart));
}
