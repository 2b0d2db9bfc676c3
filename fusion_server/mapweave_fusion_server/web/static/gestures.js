// Mouse, pen, fingers and keys on the map.

const STEP = 60; // [px] by an arrow key
const ZOOM = 1.25;
const TURN = Math.PI / 24;
const CLICK = 5; // [px] a hand shakes

/** Turn what is done at `canvas` into calls of `on`: pan, zoom, click, hover, key. */
export function listen(canvas, on) {
  const pointers = new Map();
  let moved = 0;
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, place(event));
    moved = pointers.size > 1 ? Infinity : 0;
    canvas.classList.add("dragging");
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId), now = place(event);
    if (before === undefined) return on.hover(...now);
    moved += Math.hypot(now[0] - before[0], now[1] - before[1]);
    if (moved < CLICK) return;
    if (pointers.size === 2) pinch(pointers, event.pointerId, now, on);
    else if (pointers.size === 1) drag(canvas, event, before, now, on);
    pointers.set(event.pointerId, now);
  });
  const lift = (event) => {
    if (!pointers.delete(event.pointerId)) return;
    if (pointers.size === 0) canvas.classList.remove("dragging");
    if (event.type === "pointerup" && moved < CLICK && event.button === 0) on.click(...place(event));
  };
  canvas.addEventListener("pointerup", lift);
  canvas.addEventListener("pointercancel", lift);
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => wheel(event, on), { passive: false });
  canvas.addEventListener("keydown", (event) => key(event, on));
}

const place = (event) => [event.offsetX, event.offsetY];

function drag(canvas, event, before, now, on) {
  if (!event.shiftKey && !(event.buttons & 2)) return on.pan(now[0] - before[0], now[1] - before[1]);
  const middle = [canvas.clientWidth / 2, canvas.clientHeight / 2];
  return on.zoom(1, angle(middle, before) - angle(middle, now));
}

function pinch(pointers, moving, now, on) {
  const [[, other]] = [...pointers].filter(([id]) => id !== moving);
  const before = pointers.get(moving);
  const factor = distance(other, now) / Math.max(1, distance(other, before));
  on.zoom(factor, angle(other, before) - angle(other, now), ...other);
}

const angle = (from, to) => Math.atan2(to[1] - from[1], to[0] - from[0]);
const distance = (from, to) => Math.hypot(to[0] - from[0], to[1] - from[1]);

function wheel(event, on) {
  event.preventDefault();
  const lines = event.deltaMode === 1 ? 16 : 1;
  const amount = Math.max(-300, Math.min(300, lines * event.deltaY));
  if (event.shiftKey) on.zoom(1, amount / 600, ...place(event));
  else on.zoom(Math.exp(-amount / 400), 0, ...place(event));
}

function key(event, on) {
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  const deeds = {
    ArrowLeft: () => on.pan(STEP, 0),
    ArrowRight: () => on.pan(-STEP, 0),
    ArrowUp: () => on.pan(0, STEP),
    ArrowDown: () => on.pan(0, -STEP),
    "+": () => on.zoom(ZOOM, 0),
    "=": () => on.zoom(ZOOM, 0),
    "-": () => on.zoom(1 / ZOOM, 0),
    "[": () => on.zoom(1, TURN),
    "]": () => on.zoom(1, -TURN),
  };
  const deed = deeds[event.key] ?? (() => on.key(event.key) === true);
  if (deed() !== false) event.preventDefault();
}
