// Draws the sheet: floor, walls, paths and robots, in metres; letters and bars, in pixels.

import { move } from "./se2.js";
import { colourOf, theme } from "./palette.js";
import { counted, percent, robotsOf } from "./format.js";
import { boxOf } from "./layout.js";
import { LEVELS } from "./scene.js";

const WIDTHS = [1, 2.4]; // [px] of a wall seen once, and by many
const TAG = 20; // [px], height of a robot's name
export const FONT = '13px system-ui, "Segoe UI", "DejaVu Sans", sans-serif';

/** Run `work` with the canvas in metres, in the frame at `pose` on the sheet. */
export function within(context, camera, ratio, pose, work) {
  const [a, b, c, d, e, f] = camera.matrix.map((value) => ratio * value);
  const cos = Math.cos(pose[2]), sin = Math.sin(pose[2]);
  context.setTransform(a * cos + c * sin, b * cos + d * sin, c * cos - a * sin, d * cos - b * sin,
    a * pose[0] + c * pose[1] + e, b * pose[0] + d * pose[1] + f);
  work(1 / camera.scale);
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
}

/** Draw what nobody has seen. */
export function drawGround(context, camera) {
  context.fillStyle = theme().unknown;
  context.fillRect(0, 0, camera.width, camera.height);
}

/** Return the step of the grid [m]: whole metres, lines some 50 pixels apart at least. */
export const gridStep = (camera) => Math.max(1, niceLength(50 / camera.scale));

/** Draw a grid of lines every `step` metres over all that is there, faint. */
export function drawGrid(context, camera, step) {
  const corners = [[0, 0], [camera.width, 0], [0, camera.height], [camera.width, camera.height]].map(([u, v]) => camera.toSheet(u, v));
  const range = (axis) => {
    const values = corners.map((corner) => corner[axis]);
    return [Math.floor(Math.min(...values) / step) * step, Math.max(...values) + step];
  };
  const [left, right] = range(0), [low, high] = range(1);
  context.beginPath();
  for (let x = left; x <= right; x += step) line(context, camera.toScreen(x, low), camera.toScreen(x, high));
  for (let y = low; y <= high; y += step) line(context, camera.toScreen(left, y), camera.toScreen(right, y));
  context.globalAlpha = 0.07;
  context.strokeStyle = theme().grid;
  context.lineWidth = 1;
  context.stroke();
  context.globalAlpha = 1;
}

function line(context, from, to) {
  context.moveTo(...from);
  context.lineTo(...to);
}

/** Return 1, 2 or 5 times a power of ten, at least `least`. */
export function niceLength(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((digit) => digit * power).find((length) => length >= least * 0.999);
}

/** Draw a component's floor. */
export function drawFloor(context, scene) {
  context.fillStyle = theme().floor;
  context.fill(scene.floor);
}

/** Draw a component's walls; those that another robot saw through broken and in amber. */
export function drawWalls(context, scene, px) {
  const colours = theme();
  context.lineCap = "round";
  scene.walls.forEach((path, level) => {
    const strength = level / (LEVELS - 1);
    context.strokeStyle = mixed(colours["weak-wall"], colours.wall, strength);
    context.lineWidth = px * (WIDTHS[0] + (WIDTHS[1] - WIDTHS[0]) * strength);
    context.stroke(path);
  });
  context.lineCap = "butt";
  context.strokeStyle = colours.doubt;
  context.lineWidth = 2.2 * px;
  context.setLineDash([5 * px, 3 * px]);
  context.stroke(scene.doubts);
  context.setLineDash([]);
}

/** Return a colour between two, each #rrggbb. */
export function mixed(from, to, share) {
  const parts = (colour) => [1, 3, 5].map((k) => parseInt(colour.slice(k, k + 2), 16));
  const [a, b] = [parts(from), parts(to)];
  return `rgb(${a.map((value, k) => Math.round(value + share * (b[k] - value))).join(" ")})`;
}

/** Draw a robot's path and where it began. */
export function drawPath(context, path, start, robot, px) {
  context.strokeStyle = context.fillStyle = colourOf(robot);
  context.lineWidth = 1.6 * px;
  context.lineJoin = "round";
  context.stroke(path);
  if (start) {
    context.beginPath();
    context.arc(start[0], start[1], 3.2 * px, 0, 7);
    context.fill();
  }
}

/** Draw what a robot itself mapped: its lines, and what it saw free. */
export function drawPart(context, part, robot, px) {
  context.strokeStyle = context.fillStyle = colourOf(robot);
  context.globalAlpha = 0.16;
  context.fill(part.floor);
  context.globalAlpha = 0.9;
  context.lineWidth = 1.2 * px;
  context.stroke(part.lines);
  context.globalAlpha = 1;
}

/** Draw where the search goes on: where free space ends and no wall is near. */
export function drawFrontiers(context, scene, px) {
  context.strokeStyle = theme().good;
  context.lineWidth = 3 * px;
  context.lineCap = "round";
  context.setLineDash([0.1 * px, 6 * px]);
  context.stroke(scene.frontiers);
  context.setLineDash([]);
}

/** Draw a mark: a cross in a disc, and its label beside it, where no other of `taken` is. */
export function drawMark(context, camera, place, label, taken) {
  const [u, v] = camera.toScreen(place[0], place[1]);
  context.beginPath();
  context.arc(u, v, 8, 0, 7);
  context.fillStyle = theme().bad;
  context.fill();
  context.strokeStyle = theme().paper;
  context.lineWidth = 2;
  context.stroke();
  context.beginPath();
  for (const [x, y] of [[-3.5, -3.5], [3.5, -3.5]]) line(context, [u + x, v + y], [u - x, v - y]);
  context.stroke();
  context.font = `600 ${FONT}`;
  const width = context.measureText(label).width;
  const places = [[u + 12, v - 10], [u - 12 - width, v - 10], [u - width / 2, v + 10], [u - width / 2, v - 30]].map(([left, top]) => [left, top, width, TAG]);
  const free = places.find((one) => taken.every((other) => !overlap(one, other))) ?? places[0];
  taken.push(free);
  write(context, free[0], free[1] + 15, label);
}

/** Draw a robot at `pose` on the sheet: an arrowhead; hollow when it is gone or lost. */
export function drawRobot(context, camera, pose, robot, state) {
  const [u, v] = camera.toScreen(pose[0], pose[1]);
  const [tipU, tipV] = camera.toScreen(...move(pose, 1, 0));
  context.save();
  context.translate(u, v);
  context.rotate(Math.atan2(tipV - v, tipU - u));
  context.beginPath();
  for (const [x, y] of [[11, 0], [-7, 7.5], [-3.5, 0], [-7, -7.5]]) context.lineTo(x, y);
  context.closePath();
  context.lineJoin = "round";
  context.strokeStyle = theme().paper;
  context.lineWidth = 5;
  context.stroke();
  context.fillStyle = state === "here" ? colourOf(robot) : theme().paper;
  context.fill();
  context.strokeStyle = colourOf(robot);
  context.lineWidth = 2;
  context.stroke();
  context.restore();
}

/** Write a robot's name beside it, where no other of `taken` is; take that place. */
export function drawTag(context, camera, pose, robot, state, taken) {
  const text = state === "here" ? robot : `${robot} · ${state}`;
  const [u, v] = camera.toScreen(pose[0], pose[1]);
  context.font = `600 ${FONT}`;
  const width = context.measureText(text).width + 12;
  const places = [[u + 10, v - 28], [u + 10, v + 9], [u - 10 - width, v - 28], [u - 10 - width, v + 9], [u - width / 2, v - 50]]
    .map(([left, top]) => [Math.min(left, camera.width - width - 4), top, width, TAG]);
  const place = places.find((one) => taken.every((other) => !overlap(one, other))) ?? places[0];
  taken.push(place);
  context.beginPath();
  context.roundRect(...place, 5);
  context.fillStyle = theme().paper;
  context.fill();
  context.strokeStyle = colourOf(robot);
  context.lineWidth = 1.5;
  context.stroke();
  context.fillStyle = theme().ink;
  context.textBaseline = "middle";
  context.textAlign = "left";
  context.fillText(text, place[0] + 6, place[1] + TAG / 2 + 0.5);
}

const overlap = ([u, v, w, h], [otherU, otherV, otherW, otherH]) =>
  u < otherU + otherW && otherU < u + w && v < otherV + otherH && otherV < v + h;

/** Write above each component who is in it and how sure that is; frame it if there are several. */
export function drawCaption(context, camera, { scene, pose }, number, count) {
  const [low, high] = boxOf(scene, pose);
  const places = [low, high, [low[0], high[1]], [high[0], low[1]]].map(([x, y]) => camera.toScreen(x, y));
  const left = Math.min(...places.map(([u]) => u)) - 14, top = Math.min(...places.map(([, v]) => v)) - 14;
  const right = Math.max(...places.map(([u]) => u)) + 14, bottom = Math.max(...places.map(([, v]) => v)) + 14;
  if (count > 1) {
    context.strokeStyle = theme().quiet;
    context.setLineDash([2, 4]);
    context.lineWidth = 1.2;
    context.beginPath();
    context.roundRect(left, top, right - left, bottom - top, 10);
    context.stroke();
    context.setLineDash([]);
  }
  const captions = captionsOf(scene, number, count);
  context.font = `600 ${FONT}`;
  const fits = captions.find((caption) => count === 1 || context.measureText(caption).width < right - left);
  write(context, left + 2, top - 8, fits ?? captions.at(-1));
}

/** Return what is written above a component, the longest first: beside others it gets no wider than it. */
function captionsOf(scene, number, count) {
  const all = robotsOf(scene.names), robots = all.join(" + ");
  const which = `Component ${number} of ${count}`, title = count > 1 ? `${which}: ${robots}` : robots;
  if (scene.names.length === 1) return [`${title}  ·  not joined to another robot`, `${title}  ·  not joined`, title, robots];
  const sure = `${percent(scene.confidence)} sure`;
  const many = counted(all.length, "robot");
  return [`${title}  ·  ${sure}`, `${which}: ${many}  ·  ${sure}`, `${many}  ·  ${sure}`, many];
}

function write(context, u, v, text, align = "left") {
  context.font = `600 ${FONT}`;
  context.textAlign = align;
  context.textBaseline = "alphabetic";
  context.lineJoin = "round";
  context.lineWidth = 4;
  context.strokeStyle = theme().unknown;
  context.strokeText(text, u, v);
  context.fillStyle = theme().ink;
  context.fillText(text, u, v);
}

/** Draw a bar of a round length at the lower right. */
export function drawScaleBar(context, camera, grid) {
  const isNarrow = camera.width < 600;
  const length = niceLength((isNarrow ? 30 : 80) / camera.scale), width = length * camera.scale;
  const right = camera.width - 16, base = camera.height - 16;
  context.strokeStyle = theme().ink;
  context.lineWidth = 2;
  context.beginPath();
  context.moveTo(right - width, base - 6);
  context.lineTo(right - width, base);
  context.lineTo(right, base);
  context.lineTo(right, base - 6);
  context.stroke();
  const text = length < 1 ? `${Math.round(100 * length)} cm` : `${length} m`;
  write(context, right, base - 10, grid && !isNarrow ? `grid ${grid} m  ·  ${text}` : text, "right");
}

/** Draw what was measured: a line between points on the sheet, with its ends. */
export function drawMeasure(context, camera, points) {
  const places = points.map(([x, y]) => camera.toScreen(x, y));
  context.strokeStyle = context.fillStyle = theme().accent;
  context.lineWidth = 2;
  context.beginPath();
  places.forEach((place, k) => (k === 0 ? context.moveTo(...place) : context.lineTo(...place)));
  context.stroke();
  for (const [u, v] of places) {
    context.beginPath();
    context.arc(u, v, 4, 0, 7);
    context.fill();
  }
}

/** Draw how a version differs: walls that came, and walls that went. */
export function drawChanges(context, changes, px) {
  context.lineCap = "round";
  context.lineWidth = 3 * px;
  context.strokeStyle = theme().accent;
  context.stroke(changes.came);
  context.strokeStyle = theme().bad;
  context.setLineDash([2 * px, 4 * px]);
  context.stroke(changes.went);
  context.setLineDash([]);
}
