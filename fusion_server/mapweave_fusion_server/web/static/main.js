// Puts the page together: what the server tells goes to the map, the panel and the timeline.

import { Decisions } from "./decisions.js";
import { byId, element, write } from "./dom.js";
import { Evidence } from "./evidence.js";
import { clock, counted, percent, robotOf } from "./format.js";
import { fillLegend } from "./legend.js";
import { MapView } from "./map.js";
import { nextJoint, nextPaths } from "./next.js";
import { fillMarks, fillOrders, learnOperator } from "./orders.js";
import { onThemeChange, setRobots } from "./palette.js";
import { fetchJson, follow } from "./source.js";
import { fillSure } from "./sure.js";
import { fillTeam, writeCoordinator } from "./team.js";
import { Timeline } from "./timeline.js";

const MAX_LINES = 300;
const state = { joint: null, paths: null, team: null, lastLine: 0, wanted: 0, loading: false, against: null };

const map = new MapView(byId("map"), {
  measured: (text) => {
    byId("measured").hidden = text === null;
    write(byId("measured"), text ?? "");
    byId("measure").setAttribute("aria-pressed", String(map.measuring !== null));
  },
  key: (key) => press(key),
});
const evidence = new Evidence(byId("evidence"), {
  close: () => decisions.choose(null),
  turnOf: (name) => (map.stage.place(name)?.[2] ?? 0) + map.camera.turn,
});
const decisions = new Decisions(byId("decisions"), { show: showWhy, leave: () => evidence.leave() });
const timeline = new Timeline({ show: load, compare });

function showWhy(joint, index, pin) {
  if (!evidence.pinned || pin) decisions.choose(joint.alignments[index]);
  return evidence.show(joint, index, pin);
}

/** Show a version: made of the one before it if it can, or loaded; of several asked for, the last. */
async function load(version, changes) {
  state.wanted = version;
  if (state.loading) return;
  if (changes && follows(version)) {
    show(nextJoint(state.joint, version, changes), nextPaths(state.paths, version, changes.paths));
    return;
  }
  state.loading = true;
  if (!state.joint) write(byId("headline"), "Loading the map…");
  try {
    while (state.joint?.version !== state.wanted || state.joint?.series !== timeline.series) {
      const number = state.wanted;
      const [joint, paths] = await Promise.all([fetchJson(`/api/joint/${number}`), fetchJson(`/api/joint/${number}/paths`)]);
      if (joint === null) break;
      show(Object.assign(joint, { series: timeline.series }), paths);
    }
  } finally {
    state.loading = false;
  }
}

const follows = (version) => state.joint?.version === version - 1 && state.joint.series === timeline.series && state.paths.kept;

/** Take what was searched of a version, which is told after it. */
function takeSearched({ version, components }) {
  if (state.joint?.version !== version) return;
  state.joint.components.forEach((component, k) => Object.assign(component, components[k]));
  map.showFrontiers();
  writeLegend();
}

function show(joint, paths) {
  Object.assign(state, { joint, paths });
  nameRobots();
  map.show(joint, paths, timeline.isLatest);
  byId("no-paths").hidden = paths.kept;
  const scenes = map.stage.actors.map((actor) => actor.scene);
  decisions.show(joint);
  write(byId("decisions-count"), `(${joint.alignments.length})`);
  fillSure(byId("sure"), joint, scenes, showWhy);
  fillOrders(byId("orders"), joint);
  fillMarks(byId("marks"), joint);
  write(byId("headline"), headline(scenes));
  write(byId("map-text"), `Version ${joint.version}. ${headline(scenes)}. ${scenes.map(tellScene).join(" ")}`);
  if (map.layers.parts) loadParts();
  if (state.against) compare(state.against);
  if (state.team) showTeam(state.team); // in the colours of all there are by now
  writeLegend();
  byId("map").dataset.version = joint.version;
}

/** Give each robot of the map and of the team its colour. */
function nameRobots() {
  const mapped = (state.joint?.components ?? []).flatMap(({ robots }) => Object.keys(robots).map(robotOf));
  setRobots([...mapped, ...(state.team?.robots ?? []).map(({ robot }) => robot)]);
}

function headline(scenes) {
  const robots = new Set(scenes.flatMap((scene) => scene.names.map(robotOf)));
  const all = `${counted(robots.size, "robot")} in ${counted(scenes.length, "component")}`;
  if (scenes.length > 1) return `${all}, not joined to each other`;
  return scenes[0]?.names.length > 1 ? `${all}, ${percent(scenes[0].confidence)} sure` : all;
}

const tellScene = (scene, k) =>
  `Component ${k + 1}: ${scene.names.join(", ")}, ${counted(scene.segments.length, "wall")}.`;

function writeLegend() {
  fillLegend(byId("legend"), {
    doubtful: map.stage.actors.some(({ scene }) => scene.doubtful > 0),
    changes: state.against === null ? null : [state.joint.version, state.against],
    marks: map.layers.marks && map.stage.actors.some(({ scene }) => scene.marks.length > 0),
    frontiers: map.layers.frontiers && map.stage.actors.some(({ scene }) => scene.hasFrontiers),
    gone: map.hasRobots && (state.team?.robots ?? []).some(({ alive }) => !alive),
  });
}

/** Compare the version shown with another, or end that. */
async function compare(version) {
  state.against = version;
  const joint = version === null ? null : await fetchJson(`/api/joint/${version}`);
  if (state.against === version) map.compare(joint);
  writeLegend();
}

/** Load what each robot itself mapped, as it is now. */
async function loadParts() {
  const names = map.stage.actors.flatMap(({ scene }) => scene.names);
  await Promise.all(names.map(async (name) => {
    const part = await fetchJson(`/api/parts/${name}`);
    if (part !== null) map.setPart(name, part);
  }));
}

function showTeam(report) {
  state.team = report;
  write(byId("team-name"), report.coordinator.team);
  document.title = `${report.coordinator.team} · mapweave`;
  nameRobots();
  map.setAlive(report.robots);
  fillTeam(byId("team"), report, map.following, {
    follow: (robot) => {
      map.follow(robot);
      showTeam(report);
    },
  });
  writeCoordinator(byId("coordinator"), report.coordinator);
  writeLegend();
}

function addLines(lines) {
  const list = byId("story");
  for (const { number, time, text } of lines) {
    if (number <= state.lastLine) continue;
    state.lastLine = number;
    list.prepend(element("li", {}, element("time", {}, clock(time)), text));
  }
  while (list.children.length > MAX_LINES) list.lastChild.remove();
}

async function onContact(here) {
  byId("live").classList.toggle("here", here);
  write(byId("live"), here ? "live" : "no contact");
  byId("stale").hidden = here;
  const since = state.team ? ` since ${clock(state.team.coordinator.stamp)}` : "";
  write(byId("stale"), here ? "" : `Nothing was heard of the coordinator${since}: what is shown may be out of date.`);
  if (!here) return;
  const { lines } = await fetchJson("/api/story");
  // A coordinator that was started again counts its lines anew.
  if (lines.length && lines.at(-1).number < state.lastLine) state.lastLine = 0;
  addLines(lines);
}

function press(key) {
  const deeds = {
    m: () => map.measure(map.measuring === null),
    l: () => timeline.goLatest(),
    ",": () => timeline.step(-1),
    ".": () => timeline.step(1),
    "?": () => byId("keys").showModal(),
    Escape: () => {
      evidence.close();
      map.measure(false);
      map.following = null;
    },
  };
  const deed = deeds[key];
  return deed ? (deed(), true) : false;
}

/** Keep the secret that orders need, and take it out of the address: links are passed on. */
function takeToken() {
  const given = new URLSearchParams(location.hash.slice(1)).get("token");
  if (given) sessionStorage.setItem("mapweave-token", given);
}

function connectControls() {
  const clicks = {
    "zoom-in": () => map.zoom(1.4, 0), "zoom-out": () => map.zoom(1 / 1.4, 0), fit: () => map.fit(),
    "turn-left": () => map.zoom(1, Math.PI / 12), "turn-right": () => map.zoom(1, -Math.PI / 12),
    measure: () => press("m"), help: () => press("?"),
  };
  for (const [id, deed] of Object.entries(clicks)) byId(id).addEventListener("click", deed);
  for (const layer of Object.keys(map.layers)) {
    byId(`layer-${layer}`).addEventListener("change", (event) => {
      map.layers[layer] = event.target.checked;
      if (layer === "parts" && event.target.checked) loadParts();
      writeLegend();
      map.refresh();
    });
  }
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape" && !byId("keys").open) press("Escape");
  });
  window.addEventListener("hashchange", () => timeline.follow(location.hash));
  onThemeChange(() => {
    writeLegend();
    if (state.team) showTeam(state.team);
    if (state.joint) decisions.show(state.joint);
  });
}

async function begin() {
  takeToken();
  const { hash } = location;
  connectControls();
  writeLegend();
  await Promise.all([timeline.load(), learnOperator()]);
  timeline.follow(hash);
  follow({ version: (event) => timeline.add(event), searched: takeSearched, team: showTeam, story: ({ lines }) => addLines(lines), poses: ({ robots }) => map.setPoses(robots), contact: onContact });
}

begin();
