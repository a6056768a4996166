/**
 * The image without the lens's distortion, to judge the intrinsics by straight edges: a grid, and lines that the person drags along
 * them. Marks belong to the image as taken, so meanwhile they are hidden and nothing can be marked.
 */

import { ink } from "../base/colours.js";
import { addLayer } from "../base/layers.js";
import { toast } from "../base/notices.js";
import { emit, on, state } from "../base/state.js";
import { requestAgain } from "../time/player.js";
import { toDevice, toImage, viewport } from "./geometry.js";

/** A line along an edge [px of the rectified image]. @typedef {{from: [number, number], to: [number, number]}} Ruler */
const COLUMNS = 12;
/** More lines than these would hide what they are laid along. */
const MOST = 6;
/** A shorter drag is a click [image px]. */
const SHORTEST = 3;
/** @type {Ruler[]} */
let rulers = [];
/** @type {Ruler|null} */
let drawing = null;
/** The intrinsics that the frames were rectified with. */
let used = "";

export function startRectified() {
  addLayer("rectified", drawRectified);
  on(["lens"], () => {
    const now = JSON.stringify(state.lens?.intrinsics ?? null);
    if (now === used) return;
    used = now;
    if (!state.rectified) return;
    if (!state.lens?.intrinsics) return setRectified(false);
    rulers = [];
    requestAgain();
  });
}

/** Why the image cannot be rectified now; "" if it can. */
export const withoutRectified = () => (state.lens?.intrinsics ? "" : "There are no intrinsics to rectify with: calibrate the lens in the menu under Lens");

/** Show the image rectified, or as taken. */
export function toggleRectified() {
  const why = withoutRectified();
  if (why && !state.rectified) return toast(`${why}.`);
  setRectified(!state.rectified);
}

/** @param {boolean} on */
function setRectified(on) {
  if (on === state.rectified) return;
  state.rectified = on;
  rulers = [];
  drawing = null;
  document.body.classList.toggle("rectified", on);
  emit("layers");
  requestAgain();
}

/** Whether marks are refused because the image is rectified; then this says so. */
export function refusesMarks() {
  if (!state.rectified) return false;
  toast("The image is rectified: marks are set in the image as taken.", "Press U to show it.");
  return true;
}

/** Begin a line. @param {number} x @param {number} y CSS px of the canvas */
export function pressRuler(x, y) {
  const at = toImage(x, y);
  drawing = { from: at, to: at };
}

/** @param {number} x @param {number} y CSS px of the canvas */
export function dragRuler(x, y) {
  if (!drawing) return;
  drawing.to = toImage(x, y);
  emit("hover");
}

/** End a line; a press that did not move wanted to mark something. */
export function dropRuler() {
  const done = drawing;
  drawing = null;
  if (!done) return;
  if (Math.hypot(done.to[0] - done.from[0], done.to[1] - done.from[1]) < SHORTEST) refusesMarks();
  else rulers = [...rulers, done].slice(-MOST);
  emit("hover");
}

/** The grid, and the lines along edges. @param {CanvasRenderingContext2D} pen */
function drawRectified(pen) {
  const step = viewport.imageWidth / COLUMNS;
  pen.lineWidth = viewport.ratio;
  for (const [colour, shift] of /** @type {[string, number][]} */ ([["rgb(0 0 0 / 35%)", viewport.ratio], ["rgb(255 255 255 / 38%)", 0]])) {
    pen.strokeStyle = colour;
    pen.beginPath();
    for (let u = step; u < viewport.imageWidth - 1; u += step) line(pen, [u - 0.5, -0.5], [u - 0.5, viewport.imageHeight - 0.5], shift);
    for (let v = step; v < viewport.imageHeight - 1; v += step) line(pen, [-0.5, v - 0.5], [viewport.imageWidth - 0.5, v - 0.5], shift);
    pen.stroke();
  }
  for (const { from, to } of drawing ? [...rulers, drawing] : rulers) {
    for (const [colour, width] of /** @type {[string, number][]} */ ([[ink.edge, 3.2], [ink.ring, 1.3]])) {
      pen.strokeStyle = colour;
      pen.lineWidth = width * viewport.ratio;
      pen.beginPath();
      line(pen, from, to, 0);
      pen.stroke();
    }
  }
}

/** @param {CanvasRenderingContext2D} pen @param {[number, number]} from @param {[number, number]} to image px @param {number} shift device px */
function line(pen, from, to, shift) {
  const [[x, y], [toX, toY]] = [toDevice(...from), toDevice(...to)];
  pen.moveTo(x + shift, y + shift);
  pen.lineTo(toX + shift, toY + shift);
}
