// A component of a version, ready to draw: walls by how strongly they are known, floor, extent.

export const LEVELS = 5; // of strength, from seen once to seen by many
export const DOUBTFUL = 0.9; // a wall less sure than this is drawn as doubtful

/** Return the component of a JOINT.json, whose robots' poses lead to the frame of its walls. */
export function sceneOf(component, strong) {
  const segments = component.polylines.flat();
  const support = component.support.flat(), confidence = component.segment_confidence.flat();
  const robots = new Map(Object.entries(component.robots)), floor = floorWithHull(component.free_space);
  const scene = {
    component,
    robots,
    names: [...robots.keys()],
    confidence: component.confidence,
    segments,
    segmentConfidence: confidence,
    doubtful: confidence.filter((sure) => sure < DOUBTFUL).length,
    walls: Array.from({ length: LEVELS }, () => new Path2D()),
    doubts: new Path2D(),
    floor: floor.path,
    marks: component.marks ?? [],
    ...frontiersOf(component),
    points: pointsOf(segments, floor.points, robots, component.marks ?? []),
  };
  segments.forEach(([x1, y1, x2, y2], k) => {
    const strength = Math.min(1, Math.log(Math.max(1, support[k])) / Math.log(strong)) * confidence[k];
    const path = confidence[k] < DOUBTFUL ? scene.doubts : scene.walls[Math.min(LEVELS - 1, Math.floor(strength * LEVELS))];
    path.moveTo(x1, y1);
    path.lineTo(x2, y2);
  });
  return scene;
}

/** Return where the search of a component goes on. */
export function frontiersOf({ frontiers = [] }) {
  return { frontiers: runsOf(frontiers), hasFrontiers: frontiers.length > 0 };
}

/** Return the support [scans] from which on a wall is drawn in full strength. */
export function strongSupport(joint) {
  const all = joint.components.flatMap((component) => component.support.flat()).sort((a, b) => a - b);
  return Math.max(2, all[Math.floor(0.85 * (all.length - 1))] ?? 2);
}

const floors = new WeakMap();

/** Return the floor and its extent; what was made of these very rings before is taken again. */
function floorWithHull(rings) {
  if (!floors.has(rings)) floors.set(rings, { path: floorOf(rings), points: hull(rings.flat()) });
  return floors.get(rings);
}

/** Return all rings in one path; turned one way, so that where they overlap they do not cancel. */
export function floorOf(rings) {
  const path = new Path2D();
  for (const ring of rings) {
    const points = areaOf(ring) < 0 ? [...ring].reverse() : ring;
    points.forEach(([x, y], k) => (k === 0 ? path.moveTo(x, y) : path.lineTo(x, y)));
    path.closePath();
  }
  return path;
}

function areaOf(ring) {
  return ring.reduce((sum, [x, y], k) => {
    const [nextX, nextY] = ring[(k + 1) % ring.length];
    return sum + x * nextY - nextX * y;
  }, 0);
}

/** Return segments as one path. */
export function linesOf(segments) {
  const path = new Path2D();
  for (const [x1, y1, x2, y2] of segments) {
    path.moveTo(x1, y1);
    path.lineTo(x2, y2);
  }
  return path;
}

/** Return runs of points as one path. */
export function runsOf(runs) {
  const path = new Path2D();
  for (const run of runs) run.forEach(([x, y], k) => (k === 0 ? path.moveTo(x, y) : path.lineTo(x, y)));
  return path;
}

function pointsOf(segments, floor, robots, marks) {
  const ends = segments.flatMap(([x1, y1, x2, y2]) => [[x1, y1], [x2, y2]]);
  const all = [...hull(ends), ...floor, ...marks.map(({ position }) => position)];
  return all.length > 0 ? hull(all) : [...robots.values()];
}

/** Return the corners of the convex hull: all that an extent, however turned, hangs on. */
export function hull(points) {
  if (points.length <= 4) return points;
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  return [...chain(sorted), ...chain(sorted.reverse())];
}

function chain(points) {
  const kept = [];
  for (const point of points) {
    while (kept.length > 1 && side(kept.at(-2), kept.at(-1), point) <= 0) kept.pop();
    kept.push(point);
  }
  return kept.slice(0, -1);
}

const side = (a, b, c) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
