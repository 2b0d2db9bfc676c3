// What lines mean.

import { element, icon } from "./dom.js";
import { theme } from "./palette.js";
import { DOUBTFUL } from "./scene.js";

/** Fill `target` with what is on the map: `shown` says which of it is. */
export function fillLegend(target, shown) {
  const colours = theme();
  const entries = [
    ["M1 7h24", { stroke: colours.wall, "stroke-width": 3 }, "wall many scans saw"],
    ["M1 7h24", { stroke: colours["weak-wall"], "stroke-width": 1.5 }, "few"],
    shown.doubtful && ["M1 7h24", { stroke: colours.doubt, "stroke-width": 2.5, "stroke-dasharray": "5 3" }, `less than ${100 * DOUBTFUL}% sure`],
    ["M1 1h24v12H1z", { stroke: colours.line, fill: colours.floor }, "seen free"],
    ["M1 1h24v12H1z", { stroke: colours.line, fill: colours.unknown }, "not seen"],
    shown.frontiers && ["M1 7h24", { stroke: colours.good, "stroke-width": 3, "stroke-dasharray": "0.1 6", "stroke-linecap": "round" }, "the search goes on"],
    shown.marks && ["M8 7a5 5 0 1 1 10 0a5 5 0 1 1-10 0M10.500 4.500l5 5M15.500 4.500l-5 5", { stroke: colours.bad, fill: "none" }, "mark"],
    shown.changes && ["M1 7h24", { stroke: colours.accent, "stroke-width": 3.5 }, `only in version ${shown.changes[0]}`],
    shown.changes && ["M1 7h24", { stroke: colours.bad, "stroke-width": 3, "stroke-dasharray": "2 4" }, `only in version ${shown.changes[1]}`],
    shown.gone && ["M18 7 4 12l4-5-4-5z", { stroke: colours.ink, fill: colours.paper }, "robot that is gone"],
  ];
  target.replaceChildren(
    ...entries.filter(Boolean).map(([path, attributes, text]) => element("span", {}, icon("0 0 26 14", path, attributes), text)),
  );
}
