"use strict";

/* Pointer, wheel and keys on a picture, and what they do to a view: {zoom, pan, turn, width, height}.
 *
 * Report.gestures(canvas, {
 *   grab(x, y),          returns {move(x, y), end()} if the pointer takes hold of something there, or null
 *   drag(dx, dy, shift), zoom(factor, x, y), click(x, y)
 * }) */
Report.gestures = function (canvas, { grab = () => null, drag, zoom, click = () => {} }) {
  const pointers = new Map();
  let moved = 0;
  const place = (event) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    const held = pointers.size ? null : grab(...place(event));
    pointers.set(event.pointerId, { at: place(event), held });
    moved = 0;
  });
  canvas.addEventListener("pointermove", (event) => {
    const pointer = pointers.get(event.pointerId);
    if (!pointer) return;
    const [before, at] = [pointer.at, place(event)];
    pointer.at = at;
    if (pointer.held) {
      pointer.held.move(...at);
      return;
    }
    const [dx, dy] = [at[0] - before[0], at[1] - before[1]];
    const other = [...pointers.values()].find((each) => each !== pointer && !each.held);
    if (other) {
      const apart = (point) => Math.hypot(point[0] - other.at[0], point[1] - other.at[1]);
      zoom(apart(at) / Math.max(1, apart(before)));
    } else drag(dx, dy, event.shiftKey);
    moved += Math.abs(dx) + Math.abs(dy);
  });
  const end = (event) => {
    const pointer = pointers.get(event.pointerId);
    if (!pointers.delete(event.pointerId)) return;
    if (pointer.held) pointer.held.end();
    else if (moved < 4 && event.type === "pointerup") click(...place(event));
  };
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", end);
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(Math.exp(-event.deltaY / 400), ...place(event));
  }, { passive: false });
};

/* Turns a view in 3D, or moves it. */
Report.drag = function (view, dimension, dx, dy, shift) {
  if (dimension === 3 && !shift) {
    view.turn[0] += dx / 150;
    view.turn[1] = Math.max(-1.5, Math.min(1.5, view.turn[1] + dy / 150));
  } else {
    view.pan[0] += dx;
    view.pan[1] += dy;
  }
};

/* Enlarges a view; the point at (x, y) stays there. */
Report.zoom = function (view, factor, x = view.width / 2, y = view.height / 2) {
  const zoom = Math.max(0.02, Math.min(1e6, view.zoom * factor));
  factor = zoom / view.zoom;
  view.pan[0] = (view.pan[0] + view.width / 2 - x) * factor - (view.width / 2 - x);
  view.pan[1] = (view.pan[1] + view.height / 2 - y) * factor - (view.height / 2 - y);
  view.zoom = zoom;
};

/* Calls the action of a key: `always`, or `here` if the picture has the focus. Keys typed into a field are left alone. */
Report.key = function (event, canvases, always, here = {}) {
  const { target } = event;
  const typing = target.matches?.("input:not([type=checkbox]):not([type=range]), select, textarea");
  if (typing || event.ctrlKey || event.metaKey || event.altKey) return;
  // Space presses the button that has the focus.
  if (event.key === " " && target.matches?.("button, summary, input[type=checkbox]")) return;
  const action = (canvases.includes(target) ? here[event.key] : null) ?? always[event.key];
  if (!action) return;
  event.preventDefault();
  action();
};

/* Keys that move or turn a view by a step. */
Report.arrows = { ArrowLeft: [24, 0], ArrowRight: [-24, 0], ArrowUp: [0, 24], ArrowDown: [0, -24] };
