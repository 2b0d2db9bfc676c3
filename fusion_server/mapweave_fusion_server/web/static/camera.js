// Which part of the sheet is seen: its middle [m], pixels a metre, and how the sheet is turned.

import { wrap } from "./se2.js";

const SCALES = [0.5, 2000]; // [px/m]

export class Camera {
  x = 0;
  y = 0;
  scale = 40;
  turn = 0;
  width = 1;
  height = 1;

  /** The numbers for `setTransform`: from the sheet [m] to the canvas [px]. */
  get matrix() {
    const c = this.scale * Math.cos(this.turn), s = this.scale * Math.sin(this.turn);
    return [c, -s, -s, -c, this.width / 2 - c * this.x + s * this.y, this.height / 2 + s * this.x + c * this.y];
  }

  /** Return where a point of the sheet is on the canvas. */
  toScreen(x, y) {
    const [a, b, c, d, e, f] = this.matrix;
    return [a * x + c * y + e, b * x + d * y + f];
  }

  /** Return which point of the sheet is at a place of the canvas. */
  toSheet(u, v) {
    const c = Math.cos(this.turn), s = Math.sin(this.turn);
    const right = (u - this.width / 2) / this.scale, up = (this.height / 2 - v) / this.scale;
    return [this.x + c * right + s * up, this.y - s * right + c * up];
  }

  /** Move what is seen by pixels. */
  pan(du, dv) {
    const [x, y] = this.toSheet(this.width / 2 - du, this.height / 2 - dv);
    this.x = x;
    this.y = y;
  }

  /** Zoom by a factor and turn by an angle [rad]; what is at u, v stays there. */
  zoomAndTurn(factor, angle, u = this.width / 2, v = this.height / 2) {
    const [x, y] = this.toSheet(u, v);
    this.scale = Math.min(SCALES[1], Math.max(SCALES[0], this.scale * factor));
    this.turn = wrap(this.turn + angle);
    const [nowX, nowY] = this.toSheet(u, v);
    this.x += x - nowX;
    this.y += y - nowY;
  }

  /** Return middle and scale at which all `points` [m] are seen, within margins [px]. */
  fitting(points, margins) {
    const c = Math.cos(this.turn), s = Math.sin(this.turn);
    const u = points.map(([x, y]) => c * x - s * y), v = points.map(([x, y]) => s * x + c * y);
    const low = [Math.min(...u), Math.min(...v)], high = [Math.max(...u), Math.max(...v)];
    const room = [this.width - margins.left - margins.right, this.height - margins.top - margins.bottom];
    const scale = Math.min(room[0] / Math.max(1, high[0] - low[0]), room[1] / Math.max(1, high[1] - low[1]), 120);
    const right = (low[0] + high[0]) / 2 + (margins.right - margins.left) / 2 / scale;
    const up = (low[1] + high[1]) / 2 + (margins.top - margins.bottom) / 2 / scale;
    return { x: c * right + s * up, y: -s * right + c * up, scale: Math.max(scale, SCALES[0]) };
  }
}
