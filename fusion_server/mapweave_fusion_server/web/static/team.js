// The team in a table, and how the coordinator is.

import { element, refill, write } from "./dom.js";
import { amount, byName, counted, duration } from "./format.js";
import { colourOf } from "./palette.js";

/** Fill `target` with a row a robot; `on.follow` takes the robot to be followed, or null. */
export function fillTeam(target, report, following, on) {
  const now = report.coordinator.stamp;
  const head = element("tr", {}, ...["Robot", "State", "Scans"].map((title, k) =>
    element("th", { scope: "col", class: k > 1 ? "number" : "" }, title)));
  const robots = [...report.robots].sort((a, b) => byName(a.robot, b.robot));
  const rows = robots.map((robot) => rowOf(robot, now, following === robot.robot, on));
  const names = robots.map(({ robot }) => robot).join(" ");
  if (target.dataset.robots !== names) {
    target.dataset.robots = names;
    target.replaceChildren(rows.length
      ? element("table", {}, element("thead", {}, head), element("tbody", {}, ...rows))
      : element("p", {}, "No robot yet."));
  }
  // Cell by cell: what is being clicked just now stays what it is.
  target.querySelectorAll("tbody tr").forEach((row, k) => refill(row, [...rows[k].children]));
}

function rowOf(robot, now, followed, on) {
  const { status } = robot;
  const swatch = element("span", { class: "swatch", "aria-hidden": "true" });
  swatch.style.background = colourOf(robot.robot);
  const follow = element("button", {
    type: "button", "aria-pressed": String(followed), "aria-label": `Follow ${robot.robot}`,
    onclick: () => on.follow(followed ? null : robot.robot), // a cell of another state is another one
  }, "follow");
  return element("tr", {},
    element("th", { scope: "row" }, element("span", { class: "name" }, swatch, robot.robot), follow),
    element("td", {}, ...stateOf(robot, now)),
    element("td", { class: "number" }, ...scansOf(status)));
}

function stateOf({ alive, runs, status, heard, map_version: held }, now) {
  const lines = [element("span", { class: alive ? "here" : "gone" }, alive ? "● here" : "○ gone")];
  if (heard !== null) lines.push(element("small", {}, `heard ${heardAgo(now - heard)}`));
  if (runs > 1) lines.push(element("small", { class: "gone" }, `${runs} agents under one name`));
  if (status) {
    const parts = status.components > 1 ? `, in ${counted(status.components, "component")}` : "";
    lines.push(element("small", {}, `${status.state}, ${counted(status.submaps, "submap")}${parts}`));
    const behind = status.submaps ? status.map_version - (held ?? 0) : 0;
    if (behind > 0) lines.push(element("small", {}, `${behind} behind here`));
    if (status.compared.length) lines.push(element("small", {}, `compares ${status.compared.join(", ")}`));
  }
  return lines;
}

function scansOf(status) {
  if (!status) return ["–"];
  const { scans_placed: placed, scans_seen: seen, scans_total: total } = status;
  const bar = total ? element("progress", { max: total, value: seen, "aria-label": `scans seen of ${total}` }) : null;
  return [`${placed}${total ? `/${total}` : ""}`, bar, placed < seen ? element("small", {}, `${seen - placed} not placed`) : null,
    element("small", {}, `${amount(sentBy(status))} sent`)].filter(Boolean);
}

const sentBy = (status) => Object.values(status.sent).reduce((sum, { bytes }) => sum + bytes, 0);
const heardAgo = (seconds) => (seconds < 2 ? "now" : `${duration(seconds)} ago`);

/** Write how the coordinator is. */
export function writeCoordinator(target, { version, started, stamp, pending, refused }) {
  const work = pending ? "a new version is being made" : "nothing waits";
  const bad = refused ? `, ${counted(refused, "message")} refused` : "";
  write(target, `Coordinator: version ${version}, ${work}, up ${duration(stamp - started)}${bad}.`);
}
