// Where each component goes on the sheet: walls upright, side by side, and where it was if it can.
//
// The components' places to each other are unknown. A component is found again by the robots in it.

import { compose, inverse, move, wrap } from "./se2.js";

const GAP = 2.5; // [m] between components, at least
const SHARE = 0.14; // of the widest, likewise
const ASKEW = Math.PI / 60; // a component that leans by more is set upright

/** Return the pose of each of `scenes` on the sheet.
 *
 * @param {Map<string, number[]>} known  where robots' components lie on the sheet by now
 * @param {number} wide  width over height of what the sheet is seen on
 */
export function arrange(scenes, known, wide) {
  const before = scenes.map((scene) => poseBefore(scene, known));
  const poses = scenes.map((scene, k) => (before[k] === null ? [0, 0, upright(scene)] : straightened(scene, before[k])));
  if (scenes.length === 1) return before[0] === null ? [centred(scenes[0], poses[0])] : poses;
  const boxes = scenes.map((scene, k) => boxOf(scene, poses[k]));
  const gap = Math.max(GAP, SHARE * Math.max(0, ...boxes.map(widthOf)));
  if (before.every((pose) => pose !== null) && apart(boxes, 0.4 * gap)) return poses;
  return shelved(poses, boxes, gap, before, wide);
}

/** Return where the component's frame is, if one of its robots' components has a place. */
function poseBefore(scene, known) {
  const name = scene.names.find((one) => known.has(one));
  return name === undefined ? null : compose(known.get(name), inverse(scene.robots.get(name)));
}

/** Return the turn [rad] that lays the walls along the sheet's edges, the wider way. */
function upright(scene) {
  const turn = -directionOf(scene);
  const [low, high] = boxOf(scene, [0, 0, turn]);
  return wrap(high[0] - low[0] >= high[1] - low[1] ? turn : turn + Math.PI / 2);
}

/** Return the mean direction of the walls, right angles counted as one, in (-pi/4, pi/4]. */
function directionOf(scene) {
  let c = 0, s = 0;
  for (const [x1, y1, x2, y2] of scene.segments) {
    const length = Math.hypot(x2 - x1, y2 - y1), four = 4 * Math.atan2(y2 - y1, x2 - x1);
    c += length * Math.cos(four);
    s += length * Math.sin(four);
  }
  return Math.atan2(s, c) / 4;
}

/** Return the pose, turned about the component's middle if its walls lean by much. */
function straightened(scene, pose) {
  const quarter = Math.PI / 2;
  const leaning = pose[2] + directionOf(scene);
  const off = leaning - quarter * Math.round(leaning / quarter);
  if (Math.abs(off) < ASKEW) return pose;
  const [u, v] = middleOf(boxOf(scene, pose));
  return compose(compose([u, v, -off], [-u, -v, 0]), pose);
}

function centred(scene, pose) {
  const [u, v] = middleOf(boxOf(scene, pose));
  return [pose[0] - u, pose[1] - v, pose[2]];
}

const middleOf = ([low, high]) => [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2];
const widthOf = ([low, high]) => high[0] - low[0];

/** Return lowest and highest corner of a component at `pose` [m]. */
export function boxOf(scene, pose) {
  const low = [Infinity, Infinity], high = [-Infinity, -Infinity];
  for (const [px, py] of scene.points) {
    const [x, y] = move(pose, px, py);
    low[0] = Math.min(low[0], x);
    low[1] = Math.min(low[1], y);
    high[0] = Math.max(high[0], x);
    high[1] = Math.max(high[1], y);
  }
  return [low, high];
}

function apart(boxes, gap) {
  return boxes.every(([low, high], k) =>
    boxes.slice(k + 1).every(([otherLow, otherHigh]) =>
      [0, 1].some((axis) => high[axis] + gap < otherLow[axis] || otherHigh[axis] + gap < low[axis])));
}

/** Return the poses with boxes on shelves, the largest first and, if it had a place, there. */
function shelved(poses, boxes, gap, before, wide) {
  const sizes = boxes.map(([low, high]) => [high[0] - low[0] + gap, high[1] - low[1] + gap]);
  const order = sizes.map((_, k) => k).sort((a, b) => sizes[b][0] * sizes[b][1] - sizes[a][0] * sizes[a][1]);
  const ways = order.map((_, k) => order.slice(0, k + 1).reduce((sum, one) => sum + sizes[one][0], 0))
    .map((limit) => shelvesOf(sizes, order, Math.max(limit, ...sizes.map(([width]) => width))));
  // Of all widths of a shelf the one by which everything is seen largest.
  const best = ways.reduce((a, b) => (Math.max(b.width / wide, b.height) < Math.max(a.width / wide, a.height) ? b : a));
  const placed = poses.map(([x, y, theta], k) => {
    const [low, high] = boxes[k], [left, top] = best.corners[k];
    return [x + left - low[0], y + top - high[1], theta];
  });
  const first = order[0];
  if (before[first] === null) return placed;
  const shift = [poses[first][0] - placed[first][0], poses[first][1] - placed[first][1]];
  return placed.map((pose) => [pose[0] + shift[0], pose[1] + shift[1], pose[2]]);
}

/** Return upper left corners on shelves of at most `limit`, and how large the whole is. */
function shelvesOf(sizes, order, limit) {
  const corners = [];
  let x = 0, top = 0, shelf = 0, width = 0;
  for (const k of order) {
    if (x > 0 && x + sizes[k][0] > limit * 1.000001) [x, top, shelf] = [0, top - shelf, 0];
    corners[k] = [x, top];
    x += sizes[k][0];
    width = Math.max(width, x);
    shelf = Math.max(shelf, sizes[k][1]);
  }
  return { corners, width, height: shelf - top };
}
