/**
 * What the page draws over the 3D view: labels, range numbers, placements, the mark under the pointer and what that is in words; and the
 * Camera view, the page's own image with the returns in front of it, projected by the server through the same lens.
 */

import { degrees, sideways, upwards } from "../base/angles.js";
import { ink, smallFont, smallPx, themeColour } from "../base/colours.js";
import { clicks, nameOf, on, residualText, state } from "../base/state.js";
import { spaceOptions } from "./options.js";
import { drawAgain, hookInto, projection, shownThere } from "./viser_hook.js";

/** @typedef {import("../messages.js").SpaceFrame} SpaceFrame */
const pane = /** @type {HTMLElement} */ (document.getElementById("space"));
export const layer = document.createElement("canvas");
const pen = /** @type {CanvasRenderingContext2D} */ (layer.getContext("2d"));
const [RING, DOT] = [8, 3.8];
/** Where words about a point stand, the preferred place first [CSS px]. */
const BESIDE = [[0, -16], [0, 18], [-70, 0], [70, 0]];
const labelHigh = () => smallPx() + 4;
/** So many frames are kept until the 3D view has drawn them. */
const MOST_FRAMES = 8;

/** Newest last. @type {SpaceFrame[]} */
let frames = [];
/** @type {Item[]|null} */
let items = null;
/** Keys of the item under the pointer, and of the one that was picked. */
const marked = { hover: "", picked: "" };
let waiting = false;

/** @param {HTMLIFrameElement} frame */
export function startLayer(frame) {
  layer.id = "space-layer";
  frame.after(layer);
  frame.addEventListener("load", () => hookUp(frame));
  new ResizeObserver(() => (drawAgain(), redraw())).observe(pane);
  on(["theme", "selected", "view", "placements", "candidates"], redraw);
  on(["shown", "overlay"], () => spaceOptions.camera && redraw());
}

/** @param {HTMLIFrameElement} frame */
async function hookUp(frame) {
  const missing = frame.contentDocument && frame.contentWindow ? await hookInto(frame.contentWindow, redraw) : ["the frame"];
  if (missing.length) console.info(`The 3D view has no labels and nothing can be picked in it: viser has no ${missing.join(", ")}.`);
  redraw();
}

/** Take what the 3D view is about to show. @param {SpaceFrame} look */
export function takeFrame(look) {
  frames = [...frames, look].slice(-MOST_FRAMES);
  redraw();
}

/** What the 3D view shows now: what it has drawn, not what was sent last. @returns {SpaceFrame|null} */
export function spaceFrame() {
  const there = shownThere();
  return frames.find((look) => look.number === there?.number) ?? frames.at(-1) ?? null;
}

/** Index of the frame at which the view stands; null before the first. @returns {number|null} */
export const frameShown = () => (spaceOptions.camera ? (state.shown?.index ?? null) : (shownThere()?.index ?? null));

/** Draw with the next screen frame. */
export function redraw() {
  items = null;
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    draw();
  });
}

/** Called after every drawing. @type {() => void} */
let told = () => {};

/** @param {() => void} listener */
export const onDrawn = (listener) => (told = listener);

/** Where the page's image is in the Camera view; null without one. @returns {{left: number, top: number, scale: number}|null} */
export function imageBox() {
  const shown = state.shown;
  if (!shown) return null;
  const scale = Math.min(layer.clientWidth / shown.width, layer.clientHeight / shown.height);
  return { left: (layer.clientWidth - shown.width * scale) / 2, top: (layer.clientHeight - shown.height * scale) / 2, scale };
}

/** From a thing's place in space and its pixel to CSS px of the view. @returns {((position: readonly number[], pixel: readonly (number|null)[]|null) => [number, number]|null)|null} */
function placing() {
  if (!spaceOptions.camera) return projection(layer.clientWidth, layer.clientHeight);
  const box = imageBox();
  if (!box) return null;
  return (_position, pixel) => (pixel && pixel[0] !== null && pixel[1] !== null ? [box.left + (pixel[0] + 0.5) * box.scale, box.top + (pixel[1] + 0.5) * box.scale] : null);
}

/** Where a return is in the view. @param {NonNullable<ReturnType<typeof placing>>} place @param {Return} seen */
const placeReturn = (place, [u, v, , , , , x, y, z]) => place([x, y, z], [u, v]);

/** Everything that can be picked, where it is in the view now. @returns {Item[]} */
export function pickable() {
  const look = spaceFrame();
  const place = placing();
  if (items || !look || !place || isLate(look)) return items ?? [];
  const made = /** @type {Item[]} */ ([]);
  /** @param {Item["kind"]} kind @param {number} index @param {[number, number]|null} at @param {string} key @param {() => string} words */
  const add = (kind, index, at, key, words) => {
    if (at && at[0] >= 0 && at[1] >= 0 && at[0] <= layer.clientWidth && at[1] <= layer.clientHeight) made.push({ kind, index, x: at[0], y: at[1], key, get words() { return words(); } });
  };
  look.returns.forEach(([seen], index) => add("return", index, placeReturn(place, seen), `return ${seen.slice(6, 9)}`, () => describeReturn(seen)));
  look.window.forEach(([seen], index) => add("window", index, placeReturn(place, seen), `return ${seen.slice(6, 9)}`, () => describeReturn(seen)));
  look.placements.forEach(({ position_m, pixel_px, state: known }, index) =>
    add("placement", index, place(position_m, pixel_px), `placement ${index}`, () => `Placement ${index + 1}: ${describePlace(position_m)}${known === "open" ? ", not clicked yet" : `, ${known}`}`));
  look.reflectors.forEach(({ id, position_m, pixel_px }, index) => add("reflector", index, place(position_m, pixel_px), `reflector ${id}`, () => `Reflector of ${nameOf(id)}: ${describePlace(position_m)}${residualOf(id)}`));
  candidates().forEach((row, index) => add("candidate", index, place(row.position_m, [row.u_px, row.v_px]), `candidate ${row.position_m}`, () => describeCandidate(row)));
  return (items = made);
}

/** The returns that may belong to the selected click. */
export const candidates = () => (state.candidates && state.candidates.click === state.selected && !state.playing ? state.candidates.rows : []);

/** @param {import("../messages.js").CandidateRow} row */
function describeCandidate({ words, snr_db: snr, probability, used, chosen }) {
  const fits = probability === null ? "" : `, ${(100 * probability).toFixed(0)} % likely`;
  return `Candidate: ${words}${snr === null ? "" : `, SNR ${snr.toFixed(0)} dB`}${fits}, ${chosen ? "chosen" : used ? "in use" : "click to choose it"}`;
}

/** While playing, the Camera view is ahead of the returns that were sent. @param {SpaceFrame} look */
const isLate = (look) => spaceOptions.camera && look.index !== state.shown?.index;

/** @param {string} id */
function residualOf(id) {
  const residual = clicks().find((click) => click.id === id)?.residual_px ?? null;
  return residual === null ? "" : `, residual ${residualText(residual)}`;
}

/** The item at a point of the view. @param {number} x @param {number} y CSS px */
export const itemAt = (x, y) => nearest(pickable(), x, y);

/** Mark the item under the pointer or the picked one. @param {"hover"|"picked"} how @param {Item|null} item @returns {boolean} whether it changed */
export function mark(how, item) {
  const key = item?.key ?? "";
  if (marked[how] === key) return false;
  marked[how] = key;
  redraw();
  return true;
}

/** Words about the picked item, if it is still shown. */
export const pickedWords = () => (marked.picked ? (pickable().find((item) => item.key === marked.picked)?.words ?? "") : "");

function draw() {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [layer.clientWidth, layer.clientHeight];
  if (layer.width !== Math.round(width * ratio) || layer.height !== Math.round(height * ratio)) [layer.width, layer.height] = [Math.round(width * ratio), Math.round(height * ratio)];
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  const look = spaceFrame();
  if (spaceOptions.camera) paintFrame(look);
  const place = placing();
  if (look && place && !isLate(look)) drawLook(look, place, new Board(width, height));
  for (const [how, colour] of /** @type {["hover"|"picked", string][]} */ ([["picked", "accent"], ["hover", "ink"]])) {
    const item = marked[how] ? pickable().find((one) => one.key === marked[how]) : undefined;
    if (item) ring(item.x, item.y, item.kind === "placement" ? RING + 4 : RING, themeColour(colour), 1.6);
  }
  told();
}

/** @param {SpaceFrame} look @param {NonNullable<ReturnType<typeof placing>>} place @param {Board} board */
function drawLook(look, place, board) {
  if (spaceOptions.camera) drawReturns(look, place);
  for (const row of candidates()) {
    const at = place(row.position_m, [row.u_px, row.v_px]);
    if (at) ring(at[0], at[1], row.used ? RING + 2 : RING, themeColour(row.used ? "attention" : "ink"), row.used ? 2 : 1.2, row.used ? [] : [3, 2]);
  }
  pen.font = smallFont(1, "600");
  board.taken.push([board.width - 13 * smallPx(), 0, board.width, 3.5 * smallPx()]); // the buttons
  for (const { words, position_m, kind } of look.labels) {
    const reflector = kind === "selected" ? look.reflectors.find(({ id }) => id === state.selected) : undefined;
    const at = place(position_m, reflector?.pixel_px ?? null);
    if (!at) continue;
    const said = kind === "selected" ? words.replace(/^c\d+/, nameOf) : words;
    BESIDE.some(([dx, dy]) => label(board, said, at[0] + dx, at[1] + dy, kind === "selected" ? "ink" : "accent"));
  }
  look.placements.forEach(({ position_m, pixel_px, state: known }, index) => {
    const at = place(position_m, pixel_px);
    if (!at || (!spaceOptions.camera && known !== "open" && known !== "marked")) return; // the scene has no ring there
    if (spaceOptions.camera && known !== "marked") ring(at[0], at[1], RING, themeColour(known === "open" ? "accent" : "faint"), 1.2, [3, 3]);
    label(board, String(index + 1), at[0] + smallPx(), at[1] - 0.9 * smallPx(), known === "open" ? "accent" : "faint");
  });
  if (spaceOptions.camera) return;
  const words = (/** @type {number} */ range) => `${Number(range.toPrecision(3))} m`;
  pen.font = smallFont();
  for (const { position_m } of look.placements) {
    const at = place(position_m, null);
    if (at) board.taken.push([at[0] - RING, at[1] - RING, at[0] + RING, at[1] + RING]);
  }
  const project = (/** @type {readonly number[]} */ point) => place(point, null);
  const size = (/** @type {number} */ range) => /** @type {[number, number]} */ ([pen.measureText(words(range)).width + 8, labelHigh()]);
  for (const { range, x, y } of ringPlaces(look.rings_m, look.ground_m, project, board, size)) write(words(range), x, y, "muted");
}

/** The page's own image, as large as it fits. @param {SpaceFrame|null} look */
function paintFrame(look) {
  pen.fillStyle = themeColour("ground");
  pen.fillRect(0, 0, layer.clientWidth, layer.clientHeight);
  const [box, shown] = [imageBox(), state.shown];
  if (!box || !shown) return;
  pen.imageSmoothingQuality = state.playing ? "low" : "high";
  pen.drawImage(shown.bitmap, box.left, box.top, shown.width * box.scale, shown.height * box.scale);
  if (!look || !isLate(look) || state.overlay?.index !== shown.index) return;
  for (const [u, v, , , , isStill] of state.overlay.returns ?? []) dot(box.left + (u + 0.5) * box.scale, box.top + (v + 0.5) * box.scale, DOT, isStill ? ink.still : ink.moving, isStill);
}

/** @param {SpaceFrame} look @param {NonNullable<ReturnType<typeof placing>>} place */
function drawReturns(look, place) {
  for (const [[u, v, , , , isStill], colour, size] of look.returns) {
    const at = place([], [u, v]);
    if (at) dot(at[0], at[1], DOT * size, colour, isStill);
  }
  for (const { pixel_px } of look.reflectors) {
    const at = place([], pixel_px);
    if (at) ring(at[0], at[1], 4, themeColour("attention"), 1.2);
  }
}

/** A return: a dot if it is static, a triangle if it moves. @param {number} x @param {number} y @param {number} size @param {string} colour @param {boolean} isStill */
function dot(x, y, size, colour, isStill) {
  pen.beginPath();
  if (isStill) pen.arc(x, y, size, 0, 2 * Math.PI);
  else {
    pen.moveTo(x, y - 1.25 * size);
    pen.lineTo(x + 1.1 * size, y + 0.9 * size);
    pen.lineTo(x - 1.1 * size, y + 0.9 * size);
    pen.closePath();
  }
  pen.fillStyle = colour;
  pen.fill();
  pen.lineWidth = 1;
  pen.strokeStyle = ink.edge;
  pen.stroke();
}

/** @param {number} x @param {number} y @param {number} radius @param {string} colour @param {number} width @param {number[]} [dashes] */
function ring(x, y, radius, colour, width, dashes = []) {
  for (const [stroke, wide] of /** @type {[string, number][]} */ ([[themeColour("ground"), width + 2], [colour, width]])) {
    pen.beginPath();
    pen.setLineDash(dashes);
    pen.arc(x, y, radius, 0, 2 * Math.PI);
    pen.strokeStyle = stroke;
    pen.lineWidth = wide;
    pen.stroke();
  }
  pen.setLineDash([]);
}

/** Write words if there is room. @param {Board} board @param {string} words @param {number} x @param {number} y @param {string} colour @returns {boolean} whether there was */
function label(board, words, x, y, colour) {
  const free = board.take(x, y, pen.measureText(words).width + 6, labelHigh());
  if (free) write(words, x, y, colour);
  return free;
}

/** Upright words on a veil, centred at a point. @param {string} words @param {number} x @param {number} y @param {string} colour */
function write(words, x, y, colour) {
  const wide = pen.measureText(words).width + 6;
  pen.fillStyle = themeColour("veil");
  pen.beginPath();
  pen.roundRect(x - wide / 2, y - labelHigh() / 2, wide, labelHigh(), 3);
  pen.fill();
  pen.fillStyle = themeColour(colour);
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(words, x, y + 0.5);
}

/** @typedef {import("../messages.js").RadarReturn} Return */
/**
 * Something that can be picked, at its place in the view [CSS px].
 * @typedef {{kind: "return"|"window"|"placement"|"reflector"|"candidate", index: number, x: number, y: number, words: string, key: string}} Item
 */

/** So far from the pointer, things can be picked [CSS px]. */
const REACH = 12;
/** Things that lead somewhere win over returns at the same place [CSS px]. */
const PREFERRED = { candidate: 5, placement: 3, reflector: 4, return: 0, window: 0 };
/** Range numbers stand along a line at one of these azimuths [deg], the first that suits. */
const AZIMUTHS = [-28, 28, -12, 12, -45, 45, 0, -60, 60, -68, 68];

/** The item nearest to a point. @param {Iterable<Item>} items @param {number} x @param {number} y CSS px @returns {Item|null} */
export function nearest(items, x, y) {
  let [best, least] = [/** @type {Item|null} */ (null), Infinity];
  for (const item of items) {
    const apart = Math.hypot(item.x - x, item.y - y);
    if (apart > REACH || apart - PREFERRED[item.kind] >= least) continue;
    [best, least] = [item, apart - PREFERRED[item.kind]];
  }
  return best;
}

/**
 * A return in words: "20.0 m, 2.5° right, 0.4° down, SNR 23 dB, 0.0 m/s, still".
 * @param {Return} seen
 */
export function describeReturn([, , range, doppler, snr, isStill, , , , age, azimuth, elevation]) {
  const words = [`${range.toFixed(1)} m`, sideways(azimuth), upwards(elevation)];
  if (snr !== null) words.push(`SNR ${snr.toFixed(0)} dB`);
  if (doppler !== null) words.push(`${fixed(doppler, 1)} m/s`, isStill ? "still" : "moving");
  if (age > 0.05) words.push(`${age.toFixed(1)} s ago`);
  return words.join(", ");
}

/** A number without "-0.0". @param {number} value @param {number} decimals */
const fixed = (value, decimals) => value.toFixed(decimals).replace(/^-(0\.?0*)$/, "$1");

/** A position in words. @param {readonly number[]} position m */
function describePlace([x, y, z]) {
  const level = Math.hypot(x, y);
  return `${Math.hypot(level, z).toFixed(1)} m, ${sideways(degrees(y, x))}, ${upwards(degrees(z, level))}`;
}

/** Boxes of words that do not overlap: the first come stay. */
export class Board {
  /** @param {number} width @param {number} height CSS px */
  constructor(width, height) {
    this.width = width;
    this.height = height;
    /** @type {[number, number, number, number][]} */
    this.taken = [];
  }

  /** Whether a box around a point is free and inside. @param {number} x @param {number} y @param {number} wide @param {number} high */
  isFree(x, y, wide, high) {
    const [left, top, right, bottom] = [x - wide / 2, y - high / 2, x + wide / 2, y + high / 2];
    if (left < 2 || top < 2 || right > this.width - 2 || bottom > this.height - 2) return false;
    return !this.taken.some(([l, t, r, b]) => left < r && right > l && top < b && bottom > t);
  }

  /** Take a box if it is free. @param {number} x @param {number} y @param {number} wide @param {number} high */
  take(x, y, wide, high) {
    if (!this.isFree(x, y, wide, high)) return false;
    this.taken.push([x - wide / 2, y - high / 2, x + wide / 2, y + high / 2]);
    return true;
  }
}

/**
 * Where the numbers of the range rings stand: along one azimuth if most can be read there, each of the others where it is free.
 * @param {readonly number[]} ranges m @param {number} ground m
 * @param {(point: readonly number[]) => [number, number]|null} project
 * @param {Board} board @param {(range: number) => [number, number]} sizeOf CSS px
 * @returns {{range: number, x: number, y: number}[]}
 */
export function ringPlaces(ranges, ground, project, board, sizeOf) {
  const at = (/** @type {number} */ range, /** @type {number} */ azimuth) => {
    const angle = (azimuth * Math.PI) / 180;
    return project([range * Math.cos(angle), range * Math.sin(angle), ground]);
  };
  const readable = (/** @type {number} */ azimuth) => {
    const trial = new Board(board.width, board.height);
    trial.taken = [...board.taken];
    return ranges.filter((range) => { const place = at(range, azimuth); return place && trial.take(...place, ...sizeOf(range)); }).length;
  };
  const counts = AZIMUTHS.map(readable);
  const first = AZIMUTHS[counts.indexOf(Math.max(...counts))];
  const placed = [];
  for (const range of ranges)
    for (const azimuth of [first, ...AZIMUTHS]) {
      const place = at(range, azimuth);
      if (!place || !board.take(...place, ...sizeOf(range))) continue;
      placed.push({ range, x: place[0], y: place[1] });
      break;
    }
  return placed;
}
