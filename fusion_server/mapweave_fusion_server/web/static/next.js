// A version made of the one before it and of what changed: what stayed is kept, and not copied.

const WALLS = ["polylines", "support", "segment_confidence"];

/** Return the version that `changes` make of `joint`, as the server tells them. */
export function nextJoint(joint, version, changes) {
  const { alignments } = assemble(joint, changes.alignments, ["alignments"]);
  const components = changes.components.map((change) => nextComponent(joint.components[change.was], change));
  return { ...joint, version, alignments, components, orders: changes.orders };
}

/** Return the paths that those of the version before have become. */
export function nextPaths(paths, version, { components, gone, robots }) {
  const all = { ...paths.components, ...components };
  for (const name of gone) delete all[name];
  return { version, kept: true, components: all, robots };
}

function nextComponent(before, change) {
  const { robots, confidence, marks } = change;
  const walls = assemble(before, change.walls, WALLS);
  const { free_space } = assemble(before, change.free_space, ["free_space"]);
  // What was searched is told later; until then it is what it was, in the frame that is the same.
  const { explored_m2, frontiers } = before && frameOf(before) === frameOf(change) ? before : {};
  return { robots, confidence, ...walls, free_space, marks, explored_m2, frontiers };
}

/** The first robot's component gives the frame. */
const frameOf = ({ robots }) => Object.keys(robots)[0];

/** Return the lists called `names`, made of pieces: places in those of `before`, or new items. */
function assemble(before, pieces, names) {
  return Object.fromEntries(names.map((name) => {
    const [only] = pieces;
    if (pieces.length === 1 && Array.isArray(only) && only[0] === 0 && only[1] === before[name].length) return [name, before[name]];
    return [name, pieces.flatMap((piece) => (Array.isArray(piece) ? before[name].slice(...piece) : piece[name]))];
  }));
}
