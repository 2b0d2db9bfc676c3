// What is least sure: the joins that were not made, the weakest that was, the walls that are doubted.

import { chipOf, endsOf, isReliedOn } from "./decisions.js";
import { element, refill } from "./dom.js";
import { counted, percent, robotsOf } from "./format.js";
import { DOUBTFUL } from "./scene.js";

/** Fill `target` for the version `joint`; `show` takes the decision to be explained. */
export function fillSure(target, joint, scenes, show) {
  const items = [notJoined(joint, scenes, show), weakest(joint, show), ...objected(joint), doubted(scenes)].filter(Boolean);
  if (target.firstChild === null) target.append(element("ul", { class: "sure" }));
  refill(target.firstChild, items.length ? items : [element("li", {}, "Nothing yet.")]);
}

/** Return who is not joined to whom, with the best that was found between them. */
function notJoined(joint, scenes, show) {
  if (scenes.length < 2) return null;
  const groups = scenes.map((scene) => robotsOf(scene.names).join(" + "));
  const whose = (name) => scenes.findIndex((scene) => scene.robots.has(name));
  const between = joint.alignments
    .map((alignment, index) => ({ alignment, index }))
    .filter(({ alignment }) => whose(alignment.reference) !== whose(alignment.other) && alignment.decision !== "accepted")
    .sort((a, b) => rank(b.alignment) - rank(a.alignment) || fit(b.alignment) - fit(a.alignment));
  const best = between[0];
  return element("li", { class: "doubt" },
    element("strong", {}, `How ${groups.join(" and ")} lie to each other is not known`),
    ...(best
      ? ["The closest: ", chipOf(best.alignment), " ", endsOf(best.alignment), `${sureness(best.alignment)}: ${best.alignment.reason}`, more(joint, best.index, show)]
      : ["Nothing was found between them yet."]));
}

/** What is ambiguous is closer than what is refused, of which no confidence is told. */
const rank = ({ decision, confidence }) => (decision === "ambiguous" ? 1 + confidence : 0);

/** Return how much more speaks for an alignment than against it [m]. */
const fit = ({ evidence: { score, common = 0, contradicted = 0 } }) => score ?? common - contradicted;
const sureness = ({ decision, confidence }) => (decision === "refused" ? "" : ` ${percent(confidence)}`);

/** Return the join that the version rests on and that is least sure. */
function weakest(joint, show) {
  const relied = joint.alignments.map((alignment, index) => ({ alignment, index })).filter(({ alignment }) => isReliedOn(alignment));
  if (relied.length === 0) return null;
  const { alignment, index } = relied.reduce((least, one) => (one.alignment.confidence < least.alignment.confidence ? one : least));
  return element("li", {},
    element("strong", {}, `Weakest join: ${alignment.reference} – ${alignment.other}, ${percent(alignment.confidence)}`),
    alignment.reason, more(joint, index, show));
}

function more(joint, index, show) {
  return element("div", {}, element("button", { type: "button", onclick: () => show(joint, index, true) }, "Show why"));
}

/** Return how many accepted alignments the version does not rest on. */
function objected(joint) {
  return [["set_aside", "set aside: others contradict it"], ["revoked", "revoked: later evidence contradicts it"], ["held", "held: relied on because the robots met before"]]
    .map(([status, words]) => [joint.alignments.filter((alignment) => alignment.status === status).length, words])
    .filter(([count]) => count > 0)
    .map(([count, words]) => element("li", { class: "doubt" }, `${counted(count, "join")} ${words}`));
}

/** Return how many walls are doubted. */
function doubted(scenes) {
  const doubtful = scenes.reduce((sum, scene) => sum + scene.doubtful, 0);
  const all = scenes.reduce((sum, scene) => sum + scene.segments.length, 0);
  if (all === 0) return null;
  return element("li", {},
    `${doubtful ? doubtful : "None"} of ${counted(all, "wall")} ${doubtful === 1 ? "is" : "are"} less than ${100 * DOUBTFUL}% sure`,
    doubtful ? ": broken lines on the map" : "");
}
