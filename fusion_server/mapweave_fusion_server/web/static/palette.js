// Colours: Okabe and Ito's for the robots, in the order of the pictures, lighter in the dark.

export const LIGHT = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f4f24"];
export const DARK = ["#4fb3f0", "#ff9255", "#3fd0a4", "#eba3cb", "#f5c04a", "#a3dcff", "#d0a27a"];

const dark = matchMedia("(prefers-color-scheme: dark)");
const NAMES = ["ink", "quiet", "paper", "unknown", "floor", "grid", "wall", "weak-wall", "doubt", "bad", "good", "accent", "line"];
let tokens = null;
let robots = [];

/** Call `listener` when the colours change. */
export function onThemeChange(listener) {
  dark.addEventListener("change", () => {
    tokens = null;
    listener();
  });
}

/** Return the page's own colours by name. */
export function theme() {
  if (tokens === null) {
    const style = getComputedStyle(document.documentElement);
    tokens = Object.fromEntries(NAMES.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  }
  return tokens;
}

/** Say which robots there are: each has the colour of its place in the order of their names. */
export function setRobots(names) {
  robots = [...new Set(names)].sort();
}

/** Return the colour of a robot. */
export function colourOf(robot) {
  const colours = dark.matches ? DARK : LIGHT;
  return colours[Math.max(0, robots.indexOf(robot)) % colours.length];
}
