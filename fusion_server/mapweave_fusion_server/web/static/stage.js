// Who is on the sheet: the components shown, where they lie, and how they move to where they go.

import { arrange, boxOf } from "./layout.js";
import { sceneOf, strongSupport } from "./scene.js";
import { between, compose, inverse, same } from "./se2.js";

export const MOVE = 900; // [ms] from where components were to where they are
const FADE = 0.3; // share of it in which the new map takes the place of the old
const still = matchMedia("(prefers-reduced-motion: reduce)");

export class Stage {
  /** Components shown: `scene`, `pose` on the sheet, and `from` while it moves. */
  actors = [];
  /** Those of the version before, while they move to where they are now. */
  leaving = [];
  strong = 2;
  #known = new Map();
  #began = -Infinity;

  /** Show the version `joint`, from `now` [ms] on; what has a place stays there if it can.
   *
   * @param {number} wide  width over height of the canvas
   */
  show(joint, now, wide) {
    this.strong = strongSupport(joint);
    const scenes = joint.components.map((component) => sceneOf(component, this.strong));
    const poses = arrange(scenes, this.#known, wide);
    const before = this.actors;
    this.actors = inReadingOrder(scenes.map((scene, k) => ({ scene, pose: poses[k] })));
    const known = new Map(this.actors.flatMap(({ scene, pose }) =>
      scene.names.map((name) => [name, compose(pose, scene.robots.get(name))])));
    this.leaving = before.map((actor) => ({ ...actor, to: goalOf(actor, known) }));
    const moves = this.leaving.some(({ pose, to }) => !same(pose, to));
    this.#known = known;
    if (moves && !still.matches) this.#began = now;
    else this.leaving = [];
  }

  /** Return what to draw at `now` [ms]: scenes with their pose and opacity, the new ones last. */
  cast(now) {
    const t = Math.min(1, (now - this.#began) / MOVE);
    if (t >= 1) this.leaving = [];
    if (this.leaving.length === 0) return this.actors.map((actor) => ({ ...actor, opacity: 1 }));
    const share = t * t * (3 - 2 * t), opacity = Math.max(0, (t - 1 + FADE) / FADE);
    return [
      ...this.leaving.map(({ scene, pose, to }) => ({ scene, pose: between(pose, to, share), opacity: 1 - opacity })),
      ...this.actors.map((actor) => ({ ...actor, opacity })),
    ];
  }

  get isMoving() {
    return this.leaving.length > 0;
  }

  /** Return all corners of what is shown, where it goes. */
  get corners() {
    return this.actors.flatMap(({ scene, pose }) => {
      const [low, high] = boxOf(scene, pose);
      return [low, high, [low[0], high[1]], [high[0], low[1]]];
    });
  }

  /** Return where a robot's component lies on the sheet, null if it is not there. */
  place(name) {
    return this.#known.get(name) ?? null;
  }
}

/** Return the components from the upper left to the lower right, as they are counted. */
function inReadingOrder(actors) {
  const boxes = new Map(actors.map((actor) => [actor, boxOf(actor.scene, actor.pose)]));
  return [...actors].sort((a, b) => {
    const [low, high] = boxes.get(a), [otherLow, otherHigh] = boxes.get(b);
    const isBeside = low[1] < otherHigh[1] && otherLow[1] < high[1];
    return isBeside ? low[0] - otherLow[0] : otherHigh[1] - high[1];
  });
}

/** Return where a component of the version before goes: with the first of its robots that is left. */
function goalOf({ scene, pose }, known) {
  const name = scene.names.find((one) => known.has(one));
  return name === undefined ? pose : compose(known.get(name), inverse(scene.robots.get(name)));
}
