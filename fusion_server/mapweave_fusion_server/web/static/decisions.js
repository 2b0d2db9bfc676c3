// The decisions of a version, the latest change first, each with its reason and its numbers.

import { element, refill } from "./dom.js";
import { degrees, metres, percent, robotOf } from "./format.js";
import { colourOf } from "./palette.js";

const KINDS = {
  revoked: { label: "revoked", mark: "↶", look: "bad", rank: 0 },
  set_aside: { label: "set aside", mark: "⇥", look: "bad", rank: 1 },
  held: { label: "held", mark: "⏸", look: "doubt", rank: 2 },
  ambiguous: { label: "ambiguous", mark: "?", look: "doubt", rank: 3 },
  accepted: { label: "accepted", mark: "✓", look: "good", rank: 4 },
  refused: { label: "refused", mark: "✕", look: "", rank: 5 },
};
const BEYOND = ["coincides where both looked", "held across the walls", "maps go on for", "parts that agree"]; // what the sentence does not say
const WAIT = 250; // [ms] a pointer rests on a decision before its evidence is shown

/** Return what became of an alignment. */
export const kindOf = (alignment) => KINDS[alignment.status] ?? KINDS[alignment.decision];

/** Tell whether the version rests on it. */
export const isReliedOn = (alignment) => ["relied_on", "held"].includes(alignment.status);

/** Return the names of both ends, each with the colour of its robot. */
export function endsOf(alignment) {
  const end = (name) => {
    const swatch = element("span", { class: "swatch", "aria-hidden": "true" });
    swatch.style.background = colourOf(robotOf(name));
    return element("span", { class: "name" }, swatch, name);
  };
  return element("span", {}, end(alignment.reference), " – ", end(alignment.other));
}

/** Return a label that says what became of an alignment. */
export function chipOf(alignment) {
  const { label, mark, look } = kindOf(alignment);
  return element("span", { class: `chip ${look}` }, `${mark} ${label}`);
}

export class Decisions {
  #list;
  #on;
  #since = new Map();
  #timer = 0;
  #joint = null;
  #chosen = null;

  /** @param {object} on  `show` takes the alignment whose evidence is asked for, and its place. */
  constructor(list, on) {
    this.#list = list;
    this.#on = on;
  }

  /** Show the decisions of `joint`; what changed since an earlier one that was shown goes first. */
  show(joint) {
    joint.alignments.forEach((alignment) => this.#remember(alignment, joint.version));
    const order = joint.alignments.map((alignment) => ({ alignment, since: this.#changed(alignment) }));
    order.sort((a, b) => b.since - a.since || kindOf(a.alignment).rank - kindOf(b.alignment).rank
      || a.alignment.confidence - b.alignment.confidence);
    this.#joint = joint;
    refill(this.#list, order.map(({ alignment }) => this.#item(alignment)));
  }

  /** Mark the decision whose evidence is shown; null marks none. */
  choose(alignment) {
    this.#chosen = alignment === null ? null : pairOf(alignment);
    for (const item of this.#list.children) item.classList.toggle("chosen", item.dataset.pair === this.#chosen);
  }

  #show(pair, pin) {
    this.#on.show(this.#joint, this.#joint.alignments.findIndex((alignment) => pairOf(alignment) === pair), pin);
  }

  #remember(alignment, version) {
    const pair = pairOf(alignment), label = kindOf(alignment).label;
    const before = this.#since.get(pair);
    if (before?.label !== label) this.#since.set(pair, { label, version });
  }

  #changed(alignment) {
    return this.#since.get(pairOf(alignment)).version;
  }

  #item(alignment) {
    const pair = pairOf(alignment);
    const sure = alignment.decision === "refused" ? null : element("span", { class: "sureness" }, percent(alignment.confidence));
    const button = element("button", { class: "decision", type: "button", onclick: () => this.#show(pair, true) },
      element("span", { class: "decision-head" }, chipOf(alignment), endsOf(alignment), sure),
      element("small", {}, alignment.reason),
      numbersOf(alignment, BEYOND));
    const rest = () => {
      clearTimeout(this.#timer);
      this.#timer = setTimeout(() => this.#show(pair, false), WAIT);
    };
    button.addEventListener("pointerenter", (event) => event.pointerType === "mouse" && rest());
    button.addEventListener("pointerleave", () => {
      clearTimeout(this.#timer);
      this.#on.leave();
    });
    return element("li", { class: pair === this.#chosen ? "chosen" : "", "data-pair": pair }, button);
  }
}

const pairOf = ({ reference, other }) => `${reference} ${other}`;

/** Return the evidence in numbers: all of it, or those that are named. */
export function numbersOf({ evidence, runner_up: rival }, named = null) {
  const rows = [
    ["in common", evidence.common, metres],
    ["contradicted", evidence.contradicted, metres],
    ["coincides where both looked", evidence.overlap, percentOf],
    ["held across the walls", evidence.held, metres],
    ["maps go on for", evidence.reach, metres],
    ["parts that agree", evidence.parts, String],
    ["runner-up away", rival?.distance, metres],
    ["turned by", rival?.turn, degrees],
  ].filter(([name, value]) => typeof value === "number" && (named === null || named.includes(name)));
  return element("dl", { class: "numbers" },
    ...rows.map(([name, value, tell]) => element("div", {}, element("dt", {}, name), element("dd", {}, tell(value)))));
}

const percentOf = (share) => `${(100 * share).toFixed(share > 0.99 && share < 1 ? 1 : 0)}%`;
