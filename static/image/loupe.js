/** The loupe: the image around a point, magnified 4 to 16 times, with a cross centred on the point to a fraction of a pixel. */

import { ink, smallFont, smallPx } from "../base/colours.js";
import { clickIn, on, state } from "../base/state.js";
import { viewport } from "./geometry.js";

const SIDE = 156;
const MAGNIFICATIONS = [4, 6, 8, 12, 16];
const MARGIN = 8;
/** Below the chips and the readout, on the largest screens too [CSS px]. */
const TOP = 50;
/** The loupe is not needed where the image itself is magnified nearly as much: above this share. */
const NEEDLESS_FROM = 0.75;
/** The borders of pixels are drawn from this magnification on, quarters of the pixel under the cross from the next. */
const GRID_FROM = 8;
const QUARTERS_FROM = 12;
/** This share of the darkest and of the brightest pixels may saturate when the contrast is stretched. */
const SATURATED = 0.02;
const KEPT = "cocalib-loupe";
const canvas = /** @type {HTMLCanvasElement} */ (document.getElementById("loupe"));
const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
/** The pixels around the point, one to one. */
const patch = document.createElement("canvas");
const patchPen = /** @type {CanvasRenderingContext2D} */ (patch.getContext("2d", { willReadFrequently: true }));
/** @type {{u: number, v: number}|null} */
let held = null;
let kept = { magnifies: 8, stretched: false };

export function startLoupe() {
  canvas.style.width = canvas.style.height = `${SIDE}px`;
  canvas.style.top = `${TOP}px`;
  try {
    const before = JSON.parse(localStorage.getItem(KEPT) ?? "{}");
    kept = { magnifies: MAGNIFICATIONS.includes(before.magnifies) ? before.magnifies : 8, stretched: before.stretched === true };
  } catch {
    // Without storage, the loupe starts as usual.
  }
  on(["hover", "shown", "view", "playing", "box"], draw);
  canvas.parentElement?.addEventListener("wheel", wheeled, { capture: true, passive: false });
}

/** Keep the loupe on a point while a mark is dragged or nudged. @param {{u: number, v: number}|null} point */
export function hold(point) {
  held = point;
  draw();
}

/** Magnify more, or less. @param {1|-1} direction */
export function magnify(direction) {
  const next = MAGNIFICATIONS.indexOf(kept.magnifies) + direction;
  keep({ ...kept, magnifies: MAGNIFICATIONS[Math.min(MAGNIFICATIONS.length - 1, Math.max(0, next))] });
}

/** Stretch the contrast of what the loupe shows, or show it as it is. */
export function stretchContrast() {
  keep({ ...kept, stretched: !kept.stretched });
}

/** @param {typeof kept} now */
function keep(now) {
  kept = now;
  draw();
  try {
    localStorage.setItem(KEPT, JSON.stringify(kept));
  } catch {
    // Without storage, the choice is just not remembered.
  }
}

/** The wheel with Alt magnifies the loupe, not the image. @param {WheelEvent} event */
function wheeled(event) {
  if (!event.altKey) return;
  event.preventDefault();
  event.stopImmediatePropagation();
  magnify(event.deltaY < 0 ? 1 : -1);
}

function draw() {
  const point = held ?? state.hover;
  const shown = state.shown;
  const { magnifies, stretched } = kept;
  canvas.hidden = !point || !shown || state.playing || viewport.scale / viewport.ratio > NEEDLESS_FROM * magnifies;
  canvas.dataset.shows = `${magnifies} times${stretched ? ", contrast stretched" : ""}`;
  if (canvas.hidden || !point || !shown) return;
  const side = Math.round(SIDE * viewport.ratio);
  if (canvas.width !== side) canvas.width = canvas.height = side;
  place(point);
  const scale = magnifies * viewport.ratio;
  const [firstU, firstV] = takePatch(shown, point);
  if (stretched) stretch();
  pen.imageSmoothingEnabled = false;
  pen.fillStyle = "#000";
  pen.fillRect(0, 0, side, side);
  const [left, top] = [side / 2 - (point.u + 0.5) * scale, side / 2 - (point.v + 0.5) * scale];
  pen.drawImage(patch, left + firstU * scale, top + firstV * scale, patch.width * scale, patch.height * scale);
  if (magnifies >= GRID_FROM) drawGrid(left, top, scale, side, point);
  drawCross(side / 2, side / 2, side / 2, 4 * viewport.ratio, "rgb(255 255 255 / 90%)");
  const click = clickIn(shown.index);
  if (click && !held) {
    const [x, y] = [left + (click.u_px + 0.5) * scale, top + (click.v_px + 0.5) * scale];
    drawCross(x, y, 7 * viewport.ratio, 2 * viewport.ratio, ink.ring);
  }
  drawCaption(side);
}

/** Copy the pixels around a point. @param {import("../base/state.js").Shown} shown @param {{u: number, v: number}} point @returns {[number, number]} column and row of the first one */
function takePatch(shown, point) {
  const count = Math.ceil(SIDE / kept.magnifies) + 3;
  if (patch.width !== count) patch.width = patch.height = count;
  const [u, v] = [Math.round(point.u) - (count >> 1), Math.round(point.v) - (count >> 1)];
  patchPen.imageSmoothingEnabled = false;
  patchPen.clearRect(0, 0, count, count);
  patchPen.drawImage(shown.bitmap, -u, -v, shown.width, shown.height);
  return [u, v];
}

/** Stretch the contrast of the patch: its darkest pixels become black, its brightest white. */
function stretch() {
  const image = patchPen.getImageData(0, 0, patch.width, patch.height);
  const { data } = image;
  const levels = [];
  for (let at = 0; at < data.length; at += 4) if (data[at + 3]) levels.push(0.299 * data[at] + 0.587 * data[at + 1] + 0.114 * data[at + 2]);
  if (!levels.length) return;
  levels.sort((a, b) => a - b);
  const low = levels[Math.floor(SATURATED * (levels.length - 1))];
  const high = levels[Math.ceil((1 - SATURATED) * (levels.length - 1))];
  const gain = 255 / Math.max(high - low, 1);
  for (let at = 0; at < data.length; at += 1) if (at % 4 < 3) data[at] = (data[at] - low) * gain; // clamped by its type
  patchPen.putImageData(image, 0, 0);
}

/** The borders of the pixels, and quarters of the one under the cross. @param {number} left @param {number} top @param {number} scale @param {number} side @param {{u: number, v: number}} point */
function drawGrid(left, top, scale, side, point) {
  pen.lineWidth = 1;
  pen.strokeStyle = "rgb(255 255 255 / 16%)";
  pen.beginPath();
  for (let x = ((left % scale) + scale) % scale; x < side; x += scale) line(x, 0, x, side);
  for (let y = ((top % scale) + scale) % scale; y < side; y += scale) line(0, y, side, y);
  if (kept.magnifies >= QUARTERS_FROM) {
    const [x, y] = [left + Math.round(point.u) * scale, top + Math.round(point.v) * scale];
    for (const quarter of [0.25, 0.5, 0.75]) {
      line(x + quarter * scale, y, x + quarter * scale, y + scale);
      line(x, y + quarter * scale, x + scale, y + quarter * scale);
    }
  }
  pen.stroke();
}

/** @param {number} x @param {number} y @param {number} toX @param {number} toY */
function line(x, y, toX, toY) {
  pen.moveTo(Math.round(x) + 0.5, Math.round(y) + 0.5);
  pen.lineTo(Math.round(toX) + 0.5, Math.round(toY) + 0.5);
}

/** How much it magnifies, and the keys that change it. @param {number} side */
function drawCaption(side) {
  const height = (smallPx() + 4) * viewport.ratio;
  pen.fillStyle = "rgb(0 0 0 / 62%)";
  pen.fillRect(0, side - height, side, height);
  pen.fillStyle = "#fff";
  pen.font = smallFont(viewport.ratio);
  pen.textBaseline = "middle";
  pen.textAlign = "left";
  pen.fillText(`${kept.magnifies}×   [  ]`, 6 * viewport.ratio, side - height / 2);
  pen.textAlign = "right";
  pen.fillText(kept.stretched ? "contrast on   L" : "contrast   L", side - 6 * viewport.ratio, side - height / 2);
}

/** Put the loupe in a fixed corner, so that it does not follow the pointer; in the other one when the pointer comes near. @param {{u: number, v: number}} point */
function place(point) {
  const x = (viewport.left + (point.u + 0.5) * viewport.scale) / viewport.ratio;
  const y = (viewport.top + (point.v + 0.5) * viewport.scale) / viewport.ratio;
  const near = x > viewport.width - SIDE - 60 && y < SIDE + 60;
  canvas.style.left = near ? `${MARGIN}px` : `${viewport.width - SIDE - MARGIN}px`;
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
