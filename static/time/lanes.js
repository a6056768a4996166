/**
 * Draws the timeline, lane by lane: ruler, placements, clicks with their residuals as height, radar activity, how much the image
 * changes, and the current frame.
 */

import { ink, residualColour, smallFont, smallPx, themeColour } from "../base/colours.js";
import { offers } from "../base/offers.js";
import { clicks, emit, on, state, stateOf } from "../base/state.js";
import { drawGaps, drawRuler, pixelsPerSecond, RULER, toFolded } from "./ruler.js";

export const lanes = { left: 74, right: 14, gap: 4, bottom: 5 };
/** Returns per slice of time, from the server; empty until known. @type {{step_s: number, returns: number[]}} */
export const activity = { step_s: 1, returns: [] };
/** How much the image changes after some moments, from the server. @type {ImageChanges} */
export const changes = { seconds: [], grey_levels: [], complete: false };
/** Changes below this are noise of the camera, at least [grey levels]; so a recording in which nothing moves is not all bright. */
const MUCH = 12;
/** @typedef {"placements"|"clicks"|"radar"|"image"} LaneName */
/** @typedef {Record<LaneName, {top: number, bottom: number}>} Boxes */
const NAMES = { placements: "Placements", clicks: "Clicks", radar: "Radar", image: "Image" };
/** A timeline of this height has a higher lane for the image [CSS px]. */
const LARGE = 140;

/** @typedef {CanvasRenderingContext2D} Context2D */
/** What is drawn from: the visible part of the folded axis, and the way from seconds to CSS px. @typedef {{toX: (seconds: number) => number, from_s: number, to_s: number, isPart: boolean, folding: import("./ruler.js").Folding}} Axis */

/** Where each lane is; a low timeline has no room for the last ones. @param {number} height CSS px @param {boolean} [rows] whether placements lie below each other @returns {Boxes} */
export function laneBoxes(height, rows = false) {
  const image = height >= LARGE ? 15 : height >= 84 ? 9 : 0;
  const radar = height >= 48 ? Math.min(24, Math.round(height * 0.15)) : 0;
  const placements = Math.max(9, Math.min(20, Math.round(height * 0.15))) * (rows ? 1.5 : 1);
  const bottom = height - lanes.bottom;
  const radarBottom = bottom - (image ? image + lanes.gap : 0);
  const clicksBottom = radarBottom - (radar ? radar + lanes.gap : 0);
  const top = RULER + 2;
  return {
    placements: { top, bottom: top + placements },
    clicks: { top: top + placements + 2, bottom: clicksBottom },
    radar: { top: radarBottom - radar, bottom: radarBottom },
    image: { top: bottom - image, bottom },
  };
}

/**
 * Draw everything.
 * @param {Context2D} pen @param {number} width @param {number} height CSS px @param {Axis} axis @param {number|null} pointer
 */
export function drawLanes(pen, width, height, axis, pointer) {
  pen.clearRect(0, 0, width, height);
  if (!state.seconds.length) return;
  const rows = rowsOf(state.placements);
  const boxes = laneBoxes(height, rows.some(({ group }) => group.ends.length > 1));
  lanes.left = 6.7 * smallPx();
  pen.save();
  pen.beginPath();
  pen.rect(lanes.left - 8, 0, width - lanes.left + 8, height);
  pen.clip();
  drawRuler(pen, lanes.left, width, height, axis);
  drawRadar(pen, boxes.radar, axis);
  paintFrame(pen, boxes.image, axis);
  pen.fillStyle = themeColour("line-strong");
  pen.fillRect(lanes.left, boxes.clicks.bottom, width - lanes.left - lanes.right, 1);
  drawGaps(pen, height, axis);
  const sure = offers.confidences();
  const { top, bottom } = boxes.placements;
  state.placements.forEach((placement, index) => {
    const { row, group } = rows[index];
    const high = (bottom - top + 1) / group.ends.length;
    const middle = drawPlacement(pen, placement, sure.get(index) ?? 0, { top: top + row * high, bottom: top + (row + 1) * high - 1 }, axis);
    if (middle === null) return;
    if (high >= 10) drawNumber(pen, `${index + 1}`, middle + smallPx() * (row - (group.ends.length - 1) / 2), top + (row + 0.5) * high);
    else if (index === group.last) drawNumber(pen, `${group.first + 1}–${index + 1}`, middle, (top + bottom) / 2);
  });
  for (const click of clicks()) drawStem(pen, click, axis.toX(state.seconds[click.frame]), boxes.clicks);
  if (pointer !== null && pointer >= lanes.left) {
    pen.fillStyle = themeColour("line-strong");
    pen.fillRect(Math.round(pointer), RULER, 1, height - RULER);
  }
  drawCursor(pen, height, axis.toX(state.seconds[state.cursor] ?? 0));
  drawOverview(pen, width, height, axis);
  pen.restore();
  drawNames(pen, boxes);
}

/** @param {Context2D} pen @param {Boxes} boxes */
function drawNames(pen, boxes) {
  pen.font = smallFont();
  pen.textAlign = "left";
  pen.textBaseline = "middle";
  pen.fillStyle = themeColour("muted");
  for (const name of /** @type {LaneName[]} */ (Object.keys(NAMES))) {
    const { top, bottom } = boxes[name];
    if (bottom - top >= 8) pen.fillText(NAMES[name], 8, (top + bottom) / 2 + 0.5);
  }
}

/** Placements of one time are a group and lie below each other: the row of each, and its group, with when each row is free again. @param {import("../messages.js").PlacementRow[]} placements */
function rowsOf(placements) {
  let group = { ends: /** @type {number[]} */ ([]), first: 0, last: 0 };
  return placements.map(({ start_s, end_s }, index) => {
    if (group.ends.every((end) => end <= start_s)) group = { ends: [], first: index, last: index };
    const free = group.ends.findIndex((end) => end <= start_s);
    const row = free < 0 ? group.ends.length : free;
    group.ends[row] = end_s;
    group.last = index;
    return { row, group };
  });
}

/** @param {Context2D} pen @param {string} words @param {number} x @param {number} y */
function drawNumber(pen, words, x, y) {
  pen.font = smallFont(1, "600");
  [pen.textAlign, pen.textBaseline] = ["center", "middle"];
  pen.lineWidth = 3;
  pen.strokeStyle = themeColour("accent-soft");
  if (words.includes("–")) pen.strokeText(words, x, y + 0.5);
  pen.fillStyle = themeColour("ink");
  pen.fillText(words, x, y + 0.5);
}

/**
 * Marked = solid, not marked = hollow and dashed, dismissed = a line with a cross, hardly the reflector = faint.
 * With a proposal: a bar at the lower edge, the longer the surer it is.
 * @param {Context2D} pen @param {import("../messages.js").PlacementRow} placement @param {number} sure 0 to 1 @param {{top: number, bottom: number}} box @param {Axis} axis
 * @returns {number|null} x of its number, if there is room
 */
function drawPlacement(pen, placement, sure, { top, bottom }, axis) {
  if (placement.end_s < axis.from_s || placement.start_s > axis.to_s) return null;
  const here = state.seconds[state.cursor];
  const left = axis.toX(Math.max(placement.start_s, state.seconds[0]));
  const wide = Math.max(5, axis.toX(Math.min(placement.end_s, state.seconds[state.seconds.length - 1])) - left);
  const [from, to] = [Math.max(left, axis.toX(axis.from_s)), Math.min(left + wide, axis.toX(axis.to_s))]; // what is in sight of it
  const fate = stateOf(placement);
  const current = placement.start_s <= here && here <= placement.end_s;
  pen.lineWidth = 1;
  pen.beginPath();
  pen.roundRect(left, top, wide, bottom - top, 3);
  pen.strokeStyle = themeColour(current ? "ink" : fate === "dismissed" || fate === "unlikely" ? "faint" : "accent");
  if (fate === "dismissed") return drawDismissed(pen, left, left + wide, (top + bottom) / 2), null;
  pen.fillStyle = themeColour(fate === "marked" ? "accent" : "accent-soft");
  pen.globalAlpha = fate === "marked" ? 0.55 : 1;
  if (fate !== "unlikely") pen.fill();
  pen.globalAlpha = 1;
  pen.setLineDash(fate === "marked" ? [] : [3, 3]);
  pen.stroke();
  pen.setLineDash([]);
  if (sure) {
    pen.fillStyle = themeColour("accent");
    pen.fillRect(left + 1, bottom - 2.5, Math.max(2, (wide - 2) * sure), 2.5);
  }
  return to - from < 15 ? null : (from + to) / 2;
}

/** @param {Context2D} pen @param {number} left @param {number} right @param {number} y */
function drawDismissed(pen, left, right, y) {
  const [middle, arm] = [(left + right) / 2, 3.5];
  pen.beginPath();
  pen.moveTo(left, y);
  pen.lineTo(right, y);
  for (const [dx, dy] of [[arm, arm], [arm, -arm]]) {
    pen.moveTo(middle - dx, y - dy);
    pen.lineTo(middle + dx, y + dy);
  }
  pen.stroke();
}

/** @param {Context2D} pen @param {{top: number, bottom: number}} box @param {Axis} axis */
function drawRadar(pen, { top, bottom }, axis) {
  if (bottom === top) return;
  const most = Math.max(1, activity.returns.reduce((a, b) => Math.max(a, b), 0));
  pen.fillStyle = themeColour("faint");
  pen.globalAlpha = 0.6;
  const bars = columns(axis, activity.returns.length, (slice) => slice * activity.step_s, (slice) => activity.returns[slice]);
  const wide = Math.max(1, barWidth(axis, activity.step_s));
  for (const [x, value] of bars) {
    const tall = Math.max(1, (value / most) * (bottom - top));
    pen.fillRect(x, bottom - tall, wide, tall);
  }
  pen.globalAlpha = 1;
}

/** How much the image changes: low where it stands still. @param {Context2D} pen @param {{top: number, bottom: number}} box @param {Axis} axis */
function paintFrame(pen, { top, bottom }, axis) {
  if (bottom === top) return;
  pen.fillStyle = themeColour("attention");
  const most = Math.max(MUCH, ...changes.grey_levels);
  changes.seconds.forEach((at, index) => {
    const stretch = axis.folding.stretches.find(({ from, to }) => from <= at && at <= to);
    const next = Math.min(changes.seconds[index + 1] ?? Infinity, stretch?.to ?? at);
    if (next < axis.from_s || at > axis.to_s) return;
    const share = Math.min(1, changes.grey_levels[index] / most);
    const tall = Math.max(1, share * (bottom - top));
    pen.globalAlpha = 0.3 + 0.5 * share;
    pen.fillRect(axis.toX(at), bottom - tall, Math.max(1, axis.toX(next) - axis.toX(at)), tall);
  });
  pen.globalAlpha = 1;
}

/** The greatest value in each column of pixels, as [x, value]. @param {Axis} axis @param {number} count @param {(index: number) => number} time @param {(index: number) => number} value @returns {Map<number, number>} */
function columns(axis, count, time, value) {
  /** @type {Map<number, number>} */
  const found = new Map();
  const step = count > 1 ? time(1) - time(0) : 1;
  const first = Math.max(0, Math.floor((axis.from_s - time(0)) / step) - 1);
  for (let index = first; index < count && time(index) <= axis.to_s; index += 1) {
    if (!value(index)) continue;
    const x = Math.floor(axis.toX(time(index)));
    found.set(x, Math.max(found.get(x) ?? 0, value(index)));
  }
  return found;
}

/** @param {Axis} axis @param {number} step_s */
const barWidth = (axis, step_s) => Math.ceil(pixelsPerSecond(axis) * step_s) - (pixelsPerSecond(axis) * step_s > 3 ? 0.5 : 0);

/** @param {Context2D} pen @param {import("../messages.js").ClickRow} click @param {number} x @param {{top: number, bottom: number}} box */
function drawStem(pen, click, x, { top, bottom }) {
  const limit = state.view?.residual_limit_px ?? 20;
  const size = Math.min(smallPx() / 3, (bottom - top) / 3);
  const room = bottom - top - size - 1;
  const least = Math.min(6, room);
  const tall = click.residual_px === null ? least : Math.min(room, Math.max(least, (click.residual_px / (1.5 * limit)) * room));
  const colour = ["pending", "unpaired", "untouched"].includes(click.state) ? ink.grey : residualColour(click.residual_px);
  const chosen = click.id !== "" && click.id === state.selected;
  pen.strokeStyle = pen.fillStyle = colour;
  pen.lineWidth = chosen ? 2.5 : 1.5;
  pen.beginPath();
  pen.moveTo(x, bottom);
  pen.lineTo(x, bottom - tall);
  pen.stroke();
  pen.beginPath();
  head(pen, click.state, x, bottom - tall, chosen ? size + 1 : size);
  if (["excluded", "unpaired", "untouched"].includes(click.state)) {
    pen.fillStyle = themeColour("surface");
    pen.fill();
    pen.lineWidth = 1.5;
    pen.stroke();
  } else pen.fill();
}

/** Inlier = disc, outlier = diamond. @param {Context2D} pen @param {string} clickState @param {number} x @param {number} y @param {number} size */
function head(pen, clickState, x, y, size) {
  if (clickState !== "outlier") return pen.arc(x, y, size, 0, 2 * Math.PI);
  const reach = size * 1.35;
  pen.moveTo(x, y - reach);
  pen.lineTo(x + reach, y);
  pen.lineTo(x, y + reach);
  pen.lineTo(x - reach, y);
  pen.closePath();
}

/** @param {Context2D} pen @param {number} height @param {number} x */
function drawCursor(pen, height, x) {
  pen.fillStyle = themeColour("ink");
  pen.fillRect(Math.round(x), RULER, 1, height);
  pen.beginPath();
  pen.moveTo(x - 4.5, RULER - 4);
  pen.lineTo(x + 5.5, RULER - 4);
  pen.lineTo(x + 0.5, RULER + 3);
  pen.closePath();
  pen.fill();
}

/** Height of the overview below the lanes [CSS px]. */
export const OVERVIEW = 6;

/** While a part is shown: all placements below it, with the part in a frame. @param {Context2D} pen @param {number} width @param {number} height @param {Axis} axis */
function drawOverview(pen, width, height, { from_s, to_s, isPart, folding }) {
  if (!isPart) return;
  const [room, last] = [width - lanes.left - lanes.right, toFolded(folding, state.seconds[state.seconds.length - 1])];
  const at = (/** @type {number} */ seconds) => lanes.left + room * Math.min(1, Math.max(0, toFolded(folding, seconds) / last));
  const [left, wide] = [at(from_s), at(to_s) - at(from_s)];
  pen.fillStyle = themeColour("surface");
  pen.fillRect(lanes.left - 8, height - OVERVIEW, width, OVERVIEW);
  pen.fillStyle = themeColour("accent");
  for (const { start_s, end_s } of state.placements) pen.fillRect(at(start_s), height - 4, Math.max(1, at(end_s) - at(start_s) - 1), 2);
  pen.lineWidth = 1;
  pen.strokeStyle = themeColour("ink");
  pen.strokeRect(left - 1, height - 5.5, Math.max(4, wide + 2), 5);
}

/** @typedef {{seconds: number[], grey_levels: number[], complete: boolean}} ImageChanges */

/** Until all frames are compared, ask this often [ms]. */
const EVERY = 3000;
let timer = 0;

export function startImageChanges() {
  on(["placements"], () => {
    clearTimeout(timer);
    fetchChanges();
  });
}

async function fetchChanges() {
  if (state.looking || changes.complete) return;
  const ready = state.connected && !state.opening; // the banner says that the server is gone, the status that it is still opening
  const answer = ready ? await fetch("api/image_changes.json").catch(() => null) : null;
  if (answer?.ok) Object.assign(changes, await answer.json());
  emit("lanes");
  if (!changes.complete && !state.following) timer = window.setTimeout(fetchChanges, EVERY);
}
