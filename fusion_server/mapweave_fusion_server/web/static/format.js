// Numbers for a person.

/** Return a probability as the coordinator tells it: nothing is certain. */
export const percent = (p) => (p >= 0.995 ? "over 99%" : `${Math.round(100 * p)}%`);

/** Return `count` with its noun. */
export const counted = (count, noun) => `${count.toLocaleString("en")} ${noun}${count === 1 ? "" : "s"}`;

/** Return a time [s since 1970] as on a clock. */
export const clock = (time) =>
  new Date(1000 * time).toLocaleTimeString("en-GB", { hour: "2-digit", minute: "2-digit", second: "2-digit" });

/** Return a length of time [s] in the largest unit that fits. */
export function duration(seconds) {
  const whole = Math.max(0, Math.round(seconds));
  if (whole < 90) return `${whole} s`;
  if (whole < 5400) return `${Math.round(whole / 60)} min`;
  return whole < 129600 ? `${Math.round(whole / 3600)} h` : `${Math.round(whole / 86400)} days`;
}

/** Return an amount of data. */
export function amount(bytes) {
  if (bytes < 1e3) return `${bytes} B`;
  return bytes < 1e6 ? `${Math.round(bytes / 1e3)} kB` : `${(bytes / 1e6).toFixed(1)} MB`;
}

/** Return a length [m]. */
export const metres = (length) => `${length < 10 ? length.toFixed(2) : length.toFixed(1)} m`;

/** Return an angle [rad] in degrees. */
export const degrees = (angle) => `${Math.round((180 * angle) / Math.PI)}°`;

/** Return the robots of components, each once, r2 before r10. */
export const robotsOf = (names) => [...new Set(names.map(robotOf))].sort(byName);

/** Order robots' names: numbers in them count as such. */
export const byName = (a, b) => a.localeCompare(b, "en", { numeric: true });

/** Return the robot in a component's name, such as `a` in `a/0`. */
export const robotOf = (component) => component.slice(0, component.lastIndexOf("/"));
