/**
 * The keyboard's cross: digits zoom into one of nine fields, arrows move it faster the longer they are held, Enter sets the mark.
 * It starts where the radar expects the reflector. A mark that is set there without the cross being moved is a guess: it does not count.
 */

import { ink, smallFont } from "../base/colours.js";
import { addLayer } from "../base/layers.js";
import { toast } from "../base/notices.js";
import { clickIn, clicksIn, emit, isOffered, on, placementsAt, state } from "../base/state.js";
import { leaveLive } from "../time/player.js";
import { clamped, leaveCross, moveTo, place } from "./clicking.js";
import { lookInto, toDevice, viewport } from "./geometry.js";
import { fit, redraw } from "./image.js";

/** @typedef {import("../base/state.js").Cross} Cross */

/** Digits from the top left, as on the keyboard's row. */
const DIGITS = ["1", "2", "3", "4", "5", "6", "7", "8", "9"];
/** The first field around an expected position is this part of the image. */
const FIRST = 1 / 9;
/** A field smaller than this is not divided further [px]. */
const LEAST = 0.1;
/** An arrow moves the cross by this part of the field, and so much more with every repetition. */
const STEP = 1 / 60;
const GROWS = 1.18;
const MOST = 12;
/** Movements closer together than this belong to one [ms]. */
const HELD = 180;

/** Whether the cross appears by itself at the next placement. */
let wanted = false;
let pace = { factor: 1, at: 0 };

export function startCross() {
  addLayer("cross", drawCross);
  on(["shown", "overlay", "playing"], follow);
}

/** Show the cross, or hide it. */
export function toggleCross() {
  if (state.cross) return endCross();
  wanted = true;
  start();
}

/** Hide the cross, not to return at the next placement. */
function endCross() {
  wanted = false;
  leaveCross();
}

/** Another frame has its own cross. */
function follow() {
  const cross = state.cross;
  if (state.playing) return leaveCross();
  if (cross && cross.frame !== state.shown?.index) leaveCross();
  if (cross && !cross.touched && !cross.expected && expectedHere()) return start();
  if (!state.cross && wanted && state.shown && !clicksIn(state.shown.index).length && placementsAt(state.shown.index).length) start();
}

/** Where the reflector of a placement without a click is expected in the frame on screen. @returns {[number, number]|null} */
export function expectedHere() {
  const overlay = state.overlay;
  if (!overlay || overlay.index !== state.shown?.index) return null;
  const open = placementsAt(overlay.index).filter(isOffered).map((placement) => placement.range_m);
  const guess = overlay.guesses.find(([, range]) => open.some((one) => Math.abs(one - range) < 0.01));
  return guess ? guess[0] : null;
}

function start() {
  if (!state.shown || state.shown.index !== state.cursor) return;
  leaveLive();
  const expected = expectedHere();
  const [wide, high] = [viewport.imageWidth, viewport.imageHeight];
  const whole = { u: (wide - 1) / 2, v: (high - 1) / 2, wide, high };
  const [u, v] = expected ? clamped(...expected) : [whole.u, whole.v];
  const fields = expected ? [whole, { u, v, wide: wide * FIRST, high: high * FIRST }] : [whole];
  state.cross = { frame: state.shown.index, u, v, touched: false, expected: expected !== null, fields };
  look();
}

/** Zoom so that the present field fills most of the view. */
function look() {
  const cross = state.cross;
  if (!cross) return;
  const field = cross.fields[cross.fields.length - 1];
  if (cross.fields.length === 1) fit();
  else lookInto(field.u, field.v, field.wide, field.high);
  redraw();
  emit("box");
  emit("cross");
}

/** Whether the cross takes a key; then it is done. @param {string} key as actions.js writes it */
export function crossTakes(key) {
  const cross = state.cross;
  if (!cross || cross.frame !== state.shown?.index) return false;
  const plain = key.replace("Shift+", "");
  if (DIGITS.includes(key)) zoomInto(cross, DIGITS.indexOf(key));
  else if (key === "Backspace") zoomOut(cross);
  else if (key === "Escape") endCross();
  else if (plain.startsWith("Arrow") && !key.startsWith("Alt")) step(cross, plain, key !== plain);
  else return false;
  return true;
}

/** @param {Cross} cross @param {number} index of the ninth, from the top left */
function zoomInto(cross, index) {
  const field = cross.fields[cross.fields.length - 1];
  if (field.wide / 3 < LEAST) return;
  const [wide, high] = [field.wide / 3, field.high / 3];
  const next = { u: field.u + ((index % 3) - 1) * wide, v: field.v + (Math.floor(index / 3) - 1) * high, wide, high };
  cross.fields.push(next);
  if (index !== 4 || !cross.expected) touch(cross, next.u, next.v);
  look();
}

/** @param {Cross} cross */
function zoomOut(cross) {
  if (cross.fields.length > 1) cross.fields.pop();
  const field = cross.fields[cross.fields.length - 1];
  if (Math.abs(cross.u - field.u) > field.wide / 2 || Math.abs(cross.v - field.v) > field.high / 2) [cross.u, cross.v] = [field.u, field.v];
  look();
}

/** @param {Cross} cross @param {string} arrow @param {boolean} far */
function step(cross, arrow, far) {
  const now = performance.now();
  pace = { factor: now - pace.at < HELD ? Math.min(pace.factor * GROWS, MOST) : 1, at: now };
  const field = cross.fields[cross.fields.length - 1];
  const size = field.wide * STEP * pace.factor * (far ? 5 : 1);
  const [du, dv] = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[arrow] ?? [0, 0];
  touch(cross, cross.u + du * size, cross.v + dv * size);
  const outside = Math.abs(cross.u - field.u) > field.wide / 2 || Math.abs(cross.v - field.v) > field.high / 2;
  if (outside && cross.fields.length > 1) {
    cross.fields[cross.fields.length - 1] = { ...field, u: cross.u, v: cross.v };
    return look();
  }
  redraw();
  emit("cross");
}

/** @param {Cross} cross @param {number} u @param {number} v */
function touch(cross, u, v) {
  [cross.u, cross.v] = clamped(u, v);
  cross.touched = true;
}

/** Enter: set the mark where the cross is shown. @param {Cross} cross */
export function enterCross(cross) {
  const here = clickIn(cross.frame);
  if (!cross.touched && !cross.expected) return toast("Move the cross to the reflector first: digits zoom in, arrows move it.");
  const mark = cross.touched ? "clicked" : "untouched";
  const { u, v } = cross;
  if (here?.state === "untouched" && cross.touched) {
    leaveCross();
    return moveTo(here, u, v);
  }
  return place(u, v, { mark });
}

/** The cross, its field and the nine parts of that. @param {CanvasRenderingContext2D} pen */
function drawCross(pen) {
  const cross = state.cross;
  if (!cross || cross.frame !== state.shown?.index) return;
  const { unit } = viewport;
  const field = cross.fields[cross.fields.length - 1];
  const [left, top] = toDevice(field.u - field.wide / 2, field.v - field.high / 2);
  const [right, bottom] = toDevice(field.u + field.wide / 2, field.v + field.high / 2);
  pen.save();
  pen.lineWidth = unit;
  pen.strokeStyle = "rgb(255 255 255 / 45%)";
  pen.beginPath();
  for (let part = 0; part <= 3; part++) {
    const [x, y] = [left + ((right - left) * part) / 3, top + ((bottom - top) * part) / 3];
    pen.moveTo(x, top);
    pen.lineTo(x, bottom);
    pen.moveTo(left, y);
    pen.lineTo(right, y);
  }
  pen.stroke();
  pen.font = smallFont(viewport.ratio, "600");
  pen.textAlign = "left";
  pen.textBaseline = "top";
  DIGITS.forEach((digit, index) => {
    const x = left + ((right - left) * (index % 3)) / 3 + 5 * unit;
    const y = top + ((bottom - top) * Math.floor(index / 3)) / 3 + 4 * unit;
    pen.lineWidth = 3 * unit;
    pen.strokeStyle = ink.edge;
    pen.strokeText(digit, x, y);
    pen.fillStyle = "rgb(255 255 255 / 85%)";
    pen.fillText(digit, x, y);
  });
  const [x, y] = toDevice(cross.u, cross.v);
  for (const [colour, width] of /** @type {[string, number][]} */ ([[ink.edge, 3], [cross.touched ? ink.click : ink.guess, 1.3]])) {
    pen.lineWidth = width * unit;
    pen.strokeStyle = colour;
    pen.setLineDash(cross.touched ? [] : [3 * unit, 3 * unit]);
    pen.beginPath();
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      pen.moveTo(x + dx * 4 * unit, y + dy * 4 * unit);
      pen.lineTo(x + dx * 26 * unit, y + dy * 26 * unit);
    }
    pen.stroke();
  }
  pen.restore();
}
