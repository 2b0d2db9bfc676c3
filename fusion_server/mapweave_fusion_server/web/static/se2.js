// Rigid motions of the plane, [x, y, theta] in metres and radians: as in the library.

export const IDENTITY = [0, 0, 0];

/** Return `angle` in (-pi, pi]. */
export const wrap = (angle) => angle - 2 * Math.PI * Math.ceil(angle / (2 * Math.PI) - 0.5);

/** Return the pose of `second`, given in the frame `first`, in the parent of `first`. */
export function compose(first, second) {
  const [x, y] = move(first, second[0], second[1]);
  return [x, y, wrap(first[2] + second[2])];
}

/** Return the motion that undoes `pose`. */
export function inverse([x, y, theta]) {
  const c = Math.cos(theta), s = Math.sin(theta);
  return [-c * x - s * y, s * x - c * y, wrap(-theta)];
}

/** Return the point x, y, given in the frame at `pose`, in that frame's parent. */
export function move([px, py, theta], x, y) {
  const c = Math.cos(theta), s = Math.sin(theta);
  return [px + c * x - s * y, py + s * x + c * y];
}

/** Return what is a share `t` of the way from `from` to `to`, the short way round. */
export function between(from, to, t) {
  const turn = wrap(to[2] - from[2]);
  return [from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1]), from[2] + t * turn];
}

/** Tell whether two poses look the same: 2 mm and a tenth of a degree. */
export const same = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]) < 0.002 && Math.abs(wrap(a[2] - b[2])) < 0.002;
