// The map on its canvas: what is drawn, what a hand does with it, what is followed and measured.

import { Camera } from "./camera.js";
import { changesOf } from "./changes.js";
import * as draw from "./draw.js";
import { listen } from "./gestures.js";
import { metres, robotOf } from "./format.js";
import { onThemeChange } from "./palette.js";
import { floorOf, frontiersOf, linesOf, runsOf, sceneOf } from "./scene.js";
import { compose } from "./se2.js";
import { MOVE, Stage } from "./stage.js";

const MARGINS = { left: 70, right: 40, top: 92, bottom: 66 }; // [px] for what lies over the map
const SMALL_MARGINS = { left: 22, right: 22, top: 92, bottom: 66 };

export class MapView {
  camera = new Camera();
  stage = new Stage();
  layers = { paths: true, parts: false, grid: true, marks: true, frontiers: true };
  following = null;
  measuring = null;
  #canvas;
  #on;
  #fits = true;
  #asked = false;
  #tracks = new Map();
  #places = {};
  #alive = new Map();
  #poses = {};
  #isNow = true;
  #parts = new Map();
  #changes = null;
  #glide = null;

  /** @param {object} on  `measured` takes a text or null, `key` a key that is not the map's own. */
  constructor(canvas, on) {
    this.#canvas = canvas;
    this.#on = on;
    new ResizeObserver(() => this.#resize()).observe(canvas);
    onThemeChange(() => this.refresh());
    listen(canvas, {
      pan: (du, dv) => this.#free(() => this.camera.pan(du, dv)),
      zoom: (factor, turn, u, v) => this.#free(() => this.camera.zoomAndTurn(factor, turn, u, v)),
      click: (u, v) => this.#click(u, v),
      hover: (u, v) => this.#hover(u, v),
      key: (key) => this.#key(key),
    });
    this.#resize();
  }

  /** Show a version with its paths; `isNow`: robots stand where they are, not where they were. */
  show(joint, paths, isNow) {
    this.#isNow = isNow;
    this.stage.show(joint, performance.now(), this.camera.width / Math.max(1, this.camera.height));
    this.#changes = null;
    this.#tracks = new Map(Object.entries(paths.components).map(([name, { paths: runs, last }]) =>
      [name, { path: runsOf(runs), start: runs[0]?.[0], last }]));
    this.#places = paths.robots;
    if (this.#fits) this.fit(this.stage.isMoving);
    this.#follow();
    this.refresh();
  }

  /** Show where the search goes on, which is known after the rest of a version. */
  showFrontiers() {
    for (const { scene } of this.stage.actors) Object.assign(scene, frontiersOf(scene.component));
    this.refresh();
  }

  /** Show which walls differ from another version's; null shows none. */
  compare(joint) {
    const scenes = this.stage.actors.map((actor) => actor.scene);
    const others = joint?.components.map((component) => sceneOf(component, this.stage.strong));
    this.#changes = joint === null ? null : new Map(changesOf(scenes, others).map((change, k) => [scenes[k], change]));
    this.refresh();
  }

  /** Whether robots are on the map. */
  get hasRobots() {
    return this.layers.paths && this.#robots.length > 0;
  }

  /** Say which robots are alive. */
  setAlive(robots) {
    this.#alive = new Map(robots.map((robot) => [robot.robot, robot.alive]));
    this.refresh();
  }

  /** Take where the robots are now, each in its own component. */
  setPoses(robots) {
    this.#poses = robots;
    this.#follow();
    this.refresh();
  }

  /** Take what a robot itself mapped of a component, to be drawn in its colour. */
  setPart(name, part) {
    this.#parts.set(name, { floor: floorOf(part.free_space), lines: linesOf(part.segments) });
    this.refresh();
  }

  /** Show all there is, now and as it grows, until a hand moves the map; at once, or gliding. */
  fit(gliding = false) {
    this.#fits = true;
    this.following = null;
    const corners = this.stage.corners;
    if (corners.length === 0) return;
    const to = this.camera.fitting(corners, this.camera.width < 600 ? SMALL_MARGINS : MARGINS);
    const { x, y, scale } = this.camera;
    this.#glide = gliding ? { from: { x, y, scale }, to, began: performance.now() } : null;
    if (!gliding) Object.assign(this.camera, to);
    this.refresh();
  }

  zoom(factor, turn) {
    this.#free(() => this.camera.zoomAndTurn(factor, turn));
  }

  /** Keep a robot in the middle, or none. */
  follow(robot) {
    this.following = robot;
    this.#fits = false;
    this.#glide = null;
    this.#follow();
    this.refresh();
  }

  /** Begin to measure, or end it. */
  measure(wanted) {
    this.measuring = wanted ? [] : null;
    this.#canvas.classList.toggle("measuring", wanted);
    this.#on.measured(wanted ? "Click the first point" : null);
    this.refresh();
  }

  /** Draw again, once, with the next frame. */
  refresh() {
    if (this.#asked) return;
    this.#asked = true;
    requestAnimationFrame((now) => {
      this.#asked = false;
      this.#glideOn(now);
      this.#draw(now);
      if (this.stage.isMoving || this.#glide) this.refresh();
    });
  }

  /** Return where a robot is on the sheet, null where that is not known. */
  robotPose(robot, cast = this.stage.cast(performance.now())) {
    const now = this.#isNow && this.#onSheet(this.#poses[robot]?.component, this.#poses[robot]?.pose, cast);
    const name = this.#places[robot];
    return now || this.#onSheet(name, this.#tracks.get(name)?.last, cast);
  }

  /** Return where a pose in a component's own frame is on the sheet, null where that is not shown. */
  #onSheet(name, pose, cast) {
    const found = cast.filter(({ scene }) => scene.robots.has(name)).sort((a, b) => b.opacity - a.opacity)[0];
    return pose && found ? compose(compose(found.pose, found.scene.robots.get(name)), pose) : null;
  }

  get #robots() {
    return [...new Set([...Object.keys(this.#places), ...(this.#isNow ? Object.keys(this.#poses) : [])])];
  }

  /** Tell whether a robot is here, lost (its last scan fitted nowhere), or gone. */
  #stateOf(robot) {
    if (!(this.#alive.get(robot) ?? false)) return "gone";
    return this.#isNow && this.#poses[robot]?.found === false ? "lost" : "here";
  }

  #free(change) {
    this.#fits = false;
    this.#glide = null;
    this.following = null;
    change();
    this.refresh();
  }

  #glideOn(now) {
    if (this.#glide === null) return;
    const { from, to, began } = this.#glide, t = Math.min(1, Math.max(0, (now - began) / MOVE)), share = t * t * (3 - 2 * t);
    const mean = (a, b) => a + share * (b - a);
    const scale = Math.exp(mean(Math.log(from.scale), Math.log(to.scale)));
    Object.assign(this.camera, { x: mean(from.x, to.x), y: mean(from.y, to.y), scale });
    if (t === 1) this.#glide = null;
  }

  #follow() {
    const pose = this.following && this.robotPose(this.following);
    if (pose) [this.camera.x, this.camera.y] = pose;
  }

  #click(u, v) {
    if (this.measuring === null) return;
    if (this.measuring.length !== 1) this.measuring = [];
    this.measuring = [...this.measuring.slice(0, 1), this.camera.toSheet(u, v)];
    if (this.measuring.length === 2) this.#tell();
    else this.#on.measured("Click the second point");
    this.refresh();
  }

  #hover(u, v) {
    if (this.measuring?.length !== 1 && this.measuring?.open !== true) return;
    const [first] = this.measuring;
    this.measuring = Object.assign([first, this.camera.toSheet(u, v)], { open: true });
    this.#tell();
    this.refresh();
  }

  #tell() {
    const [[x1, y1], [x2, y2]] = this.measuring;
    this.#on.measured(metres(Math.hypot(x2 - x1, y2 - y1)));
  }

  #key(key) {
    const own = {
      f: () => this.fit(),
      0: () => this.zoom(1, -this.camera.turn),
      Enter: () => this.#click(this.camera.width / 2, this.camera.height / 2),
    };
    const deed = own[key.toLowerCase()] ?? own[key];
    return deed ? (deed(), true) : this.#on.key(key);
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = this.#canvas;
    const ratio = window.devicePixelRatio || 1;
    this.#canvas.width = Math.round(width * ratio);
    this.#canvas.height = Math.round(height * ratio);
    Object.assign(this.camera, { width, height });
    if (this.#fits) this.fit();
    this.refresh();
  }

  #draw(now) {
    const context = this.#canvas.getContext("2d"), camera = this.camera;
    const ratio = window.devicePixelRatio || 1;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    draw.drawGround(context, camera);
    const cast = this.stage.cast(now);
    for (const actor of cast) this.#inside(context, ratio, actor, () => draw.drawFloor(context, actor.scene));
    const step = this.layers.grid ? draw.gridStep(camera) : 0;
    if (step) draw.drawGrid(context, camera, step);
    for (const actor of cast) this.#drawActor(context, ratio, actor);
    this.stage.actors.forEach((actor, k) => {
      if (!this.stage.isMoving) draw.drawCaption(context, camera, actor, k + 1, this.stage.actors.length);
    });
    const taken = [];
    if (this.layers.marks) this.#drawMarks(context, cast, taken);
    if (this.layers.paths) this.#drawRobots(context, cast, taken);
    if (this.measuring?.length) draw.drawMeasure(context, camera, this.measuring);
    draw.drawScaleBar(context, camera, step);
  }

  #inside(context, ratio, { pose, opacity }, work) {
    context.globalAlpha = opacity;
    draw.within(context, this.camera, ratio, pose, work);
    context.globalAlpha = 1;
  }

  #drawActor(context, ratio, actor) {
    const { scene } = actor;
    for (const [name, pose] of scene.robots) {
      const part = this.layers.parts && this.#parts.get(name);
      if (part) this.#inside(context, ratio, { ...actor, pose: compose(actor.pose, pose) }, (px) => draw.drawPart(context, part, robotOf(name), px));
    }
    this.#inside(context, ratio, actor, (px) => draw.drawWalls(context, scene, px));
    if (this.layers.frontiers) this.#inside(context, ratio, actor, (px) => draw.drawFrontiers(context, scene, px));
    const changes = this.#changes?.get(scene);
    if (changes) this.#inside(context, ratio, actor, (px) => draw.drawChanges(context, changes, px));
    for (const [name, pose] of scene.robots) {
      const track = this.layers.paths && this.#tracks.get(name);
      if (track) this.#inside(context, ratio, { ...actor, pose: compose(actor.pose, pose) }, (px) => draw.drawPath(context, track.path, track.start, robotOf(name), px));
    }
  }

  #drawMarks(context, cast, taken) {
    const marks = cast.flatMap(({ scene, pose, opacity }) => scene.marks.map(({ position, label }) =>
      ({ place: compose(pose, [...position, 0]), label, opacity })));
    taken.push(...marks.map(({ place }) => this.camera.toScreen(place[0], place[1])).map(([u, v]) => [u - 9, v - 9, 18, 18]));
    for (const { place, label, opacity } of marks) {
      context.globalAlpha = opacity;
      draw.drawMark(context, this.camera, place, label, taken);
    }
    context.globalAlpha = 1;
  }

  #drawRobots(context, cast, taken) {
    const there = this.#robots.map((robot) => [this.robotPose(robot, cast), robot, this.#stateOf(robot)]);
    const shown = there.filter(([pose]) => pose !== null);
    taken.push(...shown.map(([pose]) => this.camera.toScreen(pose[0], pose[1])).map(([u, v]) => [u - 9, v - 9, 18, 18]));
    for (const one of shown) draw.drawRobot(context, this.camera, ...one);
    for (const one of shown) draw.drawTag(context, this.camera, ...one, taken);
  }
}
