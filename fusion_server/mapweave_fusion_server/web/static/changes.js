// How the walls of two versions differ.

import { linesOf } from "./scene.js";
import { compose, inverse, move } from "./se2.js";

const STEP = 0.1; // [m] between samples of a wall
const NEAR = 0.25; // [m] from a wall of the other version: the same wall
const SAME = 0.5; // share of a wall that must be near one of the other version

/** Return, for each of `scenes`, the walls that `others` lack and those that only they have. */
export function changesOf(scenes, others) {
  return scenes.map((scene) => {
    const then = others.flatMap((other) => broughtTo(scene, other));
    return {
      came: linesOf(scene.segments.filter(lackedBy(then))),
      went: linesOf(then.filter(lackedBy(scene.segments))),
    };
  });
}

/** Return the walls of a component of another version, where a robot of `scene` puts them. */
function broughtTo(scene, other) {
  const name = scene.names.find((one) => other.robots.has(one));
  if (name === undefined) return [];
  const pose = compose(scene.robots.get(name), inverse(other.robots.get(name)));
  return other.segments.map(([x1, y1, x2, y2]) => [...move(pose, x1, y1), ...move(pose, x2, y2)]);
}

/** Return what tells whether none of `segments` is near most of a segment. */
function lackedBy(segments) {
  const cells = new Map();
  for (const segment of segments) {
    for (const [x, y] of samples(segment)) {
      const key = keyOf(x, y, 0, 0);
      if (!cells.has(key)) cells.set(key, []);
      cells.get(key).push([x, y]);
    }
  }
  return (segment) => {
    const points = samples(segment);
    return points.filter(([x, y]) => isNear(cells, x, y)).length < SAME * points.length;
  };
}

const keyOf = (x, y, i, j) => `${Math.floor(x / NEAR) + i},${Math.floor(y / NEAR) + j}`;

function isNear(cells, x, y) {
  for (const i of [-1, 0, 1]) {
    for (const j of [-1, 0, 1]) {
      const found = cells.get(keyOf(x, y, i, j)) ?? [];
      if (found.some(([u, v]) => Math.hypot(u - x, v - y) < NEAR)) return true;
    }
  }
  return false;
}

function samples([x1, y1, x2, y2]) {
  const count = 1 + Math.ceil(Math.hypot(x2 - x1, y2 - y1) / STEP);
  return Array.from({ length: count }, (_, k) => {
    const t = (k + 0.5) / count;
    return [x1 + t * (x2 - x1), y1 + t * (y2 - y1)];
  });
}
