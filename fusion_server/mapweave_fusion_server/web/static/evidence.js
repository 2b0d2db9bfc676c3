// Why a decision fell: both parts as it lays them, what they share, what contradicts, the runner-up.

import { within } from "./draw.js";
import { chipOf, endsOf, numbersOf } from "./decisions.js";
import { Camera } from "./camera.js";
import { element } from "./dom.js";
import { metres, percent, robotOf } from "./format.js";
import { colourOf, theme } from "./palette.js";
import { floorOf, linesOf } from "./scene.js";
import { IDENTITY, move } from "./se2.js";
import { buttonsFor } from "./orders.js";
import { fetchJson } from "./source.js";

const DOT = 0.06; // [m], half of what a place on a wall stands for
const AROUND = 3; // [m] shown around what two parts share
const NO_MARGINS = { left: 4, right: 4, top: 4, bottom: 4 };

export class Evidence {
  #target;
  #cache = new Map();
  #asked = null;
  #on;
  pinned = false;

  /** @param {HTMLElement} target  where it is shown
   *  @param {object} on  `close`; `turnOf` says how a component lies on the map [rad]
   */
  constructor(target, on) {
    this.#target = target;
    this.#on = on;
  }

  /** Show the evidence of alignment `index` of `joint`; one that is pinned stays when it is left. */
  async show(joint, index, pin) {
    if (this.pinned && !pin) return;
    this.pinned = pin;
    const key = `${joint.version}/${index}`;
    this.#asked = key;
    const alignment = joint.alignments[index];
    if (!this.#cache.has(key)) this.#fill(alignment, [element("p", {}, "Laying the two maps on each other…")]);
    const found = await this.#fetched(key, joint.version, index, alignment);
    if (this.#asked === key) this.#fill(alignment, figuresOf(alignment, found));
    if (this.#asked === key && pin) this.#target.scrollIntoView({ block: "nearest" });
  }

  /** Take it away, if it is not pinned. */
  leave() {
    if (!this.pinned) this.close();
  }

  close() {
    this.pinned = false;
    this.#asked = null;
    this.#target.hidden = true;
    this.#on.close();
  }

  async #fetched(key, version, index, alignment) {
    if (!this.#cache.has(key)) {
      const part = (name) => fetchJson(`/api/parts/${name}`);
      const all = await Promise.all([fetchJson(`/api/joint/${version}/evidence/${index}`), part(alignment.reference), part(alignment.other)]);
      if (this.#cache.size > 20) this.#cache.clear();
      this.#cache.set(key, all.includes(null) ? null : all);
    }
    return this.#cache.get(key);
  }

  #fill(alignment, content) {
    const sure = alignment.decision === "refused" ? "" : percent(alignment.confidence);
    const close = element("button", { type: "button", onclick: () => this.close() }, "Close");
    this.#target.hidden = false;
    this.#target.replaceChildren(
      element("div", { class: "evidence-head" }, chipOf(alignment), endsOf(alignment), element("strong", {}, sure), close),
      element("p", {}, alignment.reason), ...content, buttonsFor(alignment) ?? "");
    this.#target.querySelectorAll("canvas").forEach((canvas) => canvas.paint(this.#on.turnOf(alignment.reference)));
  }
}

function figuresOf(alignment, found) {
  if (found === null) return [element("p", { class: "quiet" }, "The maps that were compared are no longer here as they were."), numbersOf(alignment)];
  const [evidence, reference, other] = found;
  const rival = alignment.runner_up;
  return [
    element("p", { class: "quiet" }, "Thick: wall that both saw. Crosses: wall where the other saw free space."),
    element("div", { class: "evidence-pair" },
      figure("As decided", evidence.best, alignment.evidence, reference, other),
      evidence.runner_up === null
        ? element("p", { class: "quiet" }, "Nothing different fits at all.")
        : figure("Runner-up, the best different one", evidence.runner_up, rival, reference, other)),
    numbersOf(alignment)];
}

function figure(title, match, numbers, reference, other) {
  const canvas = element("canvas", { role: "img", "aria-label": `${title}: ${reference.component} and ${other.component} laid on each other` });
  canvas.paint = (turn) => paint(canvas, turn, match, reference, other);
  const told = `${metres(numbers.common ?? 0)} in common, ${metres(numbers.contradicted ?? 0)} contradicted`;
  return element("figure", {}, canvas, element("figcaption", {}, element("strong", {}, title), ` · ${told}`));
}

function paint(canvas, turn, match, reference, other) {
  const ratio = window.devicePixelRatio || 1, camera = new Camera();
  Object.assign(camera, { width: canvas.clientWidth, height: canvas.clientHeight, turn });
  canvas.width = Math.round(ratio * camera.width);
  canvas.height = Math.round(ratio * camera.height);
  Object.assign(camera, camera.fitting(cornersOf(match, reference, other), NO_MARGINS));
  const context = canvas.getContext("2d");
  const parts = [[reference, IDENTITY], [other, match.transform]];
  for (const [part, pose] of parts) within(context, camera, ratio, pose, () => paintFloor(context, part));
  for (const [part, pose] of parts) within(context, camera, ratio, pose, (px) => paintLines(context, part, px));
  within(context, camera, ratio, IDENTITY, (px) => {
    paintPlaces(context, match.shared, theme().ink, Math.max(1.4 * px, DOT));
    paintCrosses(context, match.contradicted, theme().bad, 3.5 * px);
  });
}

/** Return corners of what is to be seen: around where the two touch, or all of both. */
function cornersOf(match, reference, other) {
  const places = [...match.shared, ...match.contradicted];
  if (places.length) return places.flatMap(([x, y]) => [[x - AROUND, y - AROUND], [x + AROUND, y + AROUND]]);
  return [...ends(reference, IDENTITY), ...ends(other, match.transform)];
}

function ends(part, pose) {
  return part.segments.flatMap(([x1, y1, x2, y2]) => [move(pose, x1, y1), move(pose, x2, y2)]);
}

function paintFloor(context, part) {
  context.fillStyle = colourOf(robotOf(part.component));
  context.globalAlpha = 0.15;
  context.fill(floorOf(part.free_space));
  context.globalAlpha = 1;
}

function paintLines(context, part, px) {
  context.strokeStyle = colourOf(robotOf(part.component));
  context.lineWidth = 1.5 * px;
  context.stroke(linesOf(part.segments));
}

function paintPlaces(context, places, colour, radius) {
  context.fillStyle = colour;
  for (const [x, y] of places) context.fillRect(x - radius, y - radius, 2 * radius, 2 * radius);
}

function paintCrosses(context, places, colour, radius) {
  context.beginPath();
  for (const [x, y] of places) {
    context.moveTo(x - radius, y - radius);
    context.lineTo(x + radius, y + radius);
    context.moveTo(x - radius, y + radius);
    context.lineTo(x + radius, y - radius);
  }
  context.strokeStyle = colour;
  context.lineWidth = radius / 2;
  context.stroke();
}
