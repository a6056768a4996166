// @ts-check
/** The loupe: the picture around a point, magnified eight times, with a cross centred on the point to a fraction of a pixel. */

import { ink } from "./colours.js";
import { viewport } from "./geometry.js";
import { clickIn, on, state } from "./state.js";

const SIDE = 156;
const MAGNIFIES = 8;
const MARGIN = 8;
/** Above this zoom the loupe is not needed. */
const NEEDLESS_ABOVE = 6;
const canvas = /** @type {HTMLCanvasElement} */ (document.getElementById("loupe"));
const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
/** @type {{u: number, v: number}|null} */
let held = null;

export function startLoupe() {
  canvas.style.width = canvas.style.height = `${SIDE}px`;
  on(["hover", "shown", "view", "playing", "box"], draw);
}

/** Keep the loupe on a point while a mark is dragged or nudged. @param {{u: number, v: number}|null} point */
export function hold(point) {
  held = point;
  draw();
}

function draw() {
  const point = held ?? state.hover;
  const shown = state.shown;
  canvas.hidden = !point || !shown || state.playing || viewport.scale / viewport.ratio > NEEDLESS_ABOVE;
  if (canvas.hidden || !point || !shown) return;
  const side = Math.round(SIDE * viewport.ratio);
  if (canvas.width !== side) canvas.width = canvas.height = side;
  place(point);
  const scale = MAGNIFIES * viewport.ratio;
  pen.imageSmoothingEnabled = false;
  pen.fillStyle = "#000";
  pen.fillRect(0, 0, side, side);
  const [left, top] = [side / 2 - (point.u + 0.5) * scale, side / 2 - (point.v + 0.5) * scale];
  pen.drawImage(shown.bitmap, left, top, shown.width * scale, shown.height * scale);
  drawCross(side / 2, side / 2, side / 2, 4 * viewport.ratio, "rgb(255 255 255 / 90%)");
  const click = clickIn(shown.index);
  if (click && !held) {
    const [x, y] = [left + (click.u_px + 0.5) * scale, top + (click.v_px + 0.5) * scale];
    drawCross(x, y, 7 * viewport.ratio, 2 * viewport.ratio, ink.ring);
  }
}

/** Put the loupe in a fixed corner, so that it does not follow the pointer; in the other one when the pointer comes near. @param {{u: number, v: number}} point */
function place(point) {
  const x = (viewport.left + (point.u + 0.5) * viewport.scale) / viewport.ratio;
  const y = (viewport.top + (point.v + 0.5) * viewport.scale) / viewport.ratio;
  const near = x > viewport.width - SIDE - 60 && y < SIDE + 60;
  canvas.style.left = near ? `${MARGIN}px` : `${viewport.width - SIDE - MARGIN}px`;
  canvas.style.top = near ? "40px" : `${MARGIN}px`;
}

/** @param {number} x @param {number} y @param {number} arm @param {number} gap @param {string} colour */
function drawCross(x, y, arm, gap, colour) {
  for (const [width, style] of /** @type {[number, string][]} */ ([[3, "rgb(0 0 0 / 55%)"], [1, colour]])) {
    pen.lineWidth = width * viewport.ratio;
    pen.strokeStyle = style;
    pen.beginPath();
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      pen.moveTo(x + dx * gap, y + dy * gap);
      pen.lineTo(x + dx * arm, y + dy * arm);
    }
    pen.stroke();
  }
}
