/** The timeline: where a pointer is in time, and what is there; click to go there, wheel or two fingers to zoom. lanes.js draws it. */

import { hideTip, showTip } from "../base/notices.js";
import { clicks, nameOf, on, onPainted, residualText, state, stateOf, timeText } from "../base/state.js";
import { changes, drawLanes, laneBoxes, lanes, OVERVIEW } from "./lanes.js";
import { jump, nearestIndex } from "./player.js";
import { foldingOf, gapsOf, lengthWords, toFolded, toSeconds as unfolded } from "./ruler.js";

const canvas = /** @type {HTMLCanvasElement} */ (document.getElementById("timeline"));
const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
/** A press this close to a stem goes to its frame [CSS px]; a finger hits less well. */
const REACH = 5;
const FINGER_REACH = 14;
/** How far beyond the last frame the timeline reaches while frames are added. */
const ROOM = 1.25;
/** The axis of time, without the gaps. */
let folding = foldingOf([]);
/** The visible part of the axis [drawn s]. */
const span = { from: 0, to: 1 };
/** Where fingers are [CSS px]. @type {Map<number, number>} */
const fingers = new Map();
/** @type {number|null} */
let pointer = null;
let waiting = false;
let dragging = false;
/** Whether what is dragged is the overview. */
let overview = false;
/** Width of the canvas; asking it for its own would lay the page out for each bar [CSS px]. */
let wide = 1;

export function startTimeline() {
  new ResizeObserver(redraw).observe(canvas);
  on(["recording"], () => {
    folding = foldingOf(state.seconds);
    showAll();
  });
  on(["grown"], extend);
  onPainted(["view", "placements", "shown", "selected", "cursor", "theme", "proposals", "lanes"], redraw);
  canvas.addEventListener("pointerdown", pressed);
  canvas.addEventListener("pointermove", moved);
  canvas.addEventListener("pointerup", released);
  canvas.addEventListener("pointercancel", released);
  canvas.addEventListener("pointerleave", () => {
    pointer = null;
    hideTip();
    redraw();
  });
  canvas.addEventListener("wheel", wheeled, { passive: false });
  canvas.addEventListener("dblclick", showAll);
}

/** @param {PointerEvent} event */
function pressed(event) {
  if (event.button !== 0) return;
  canvas.setPointerCapture(event.pointerId);
  if (event.pointerType === "touch") fingers.set(event.pointerId, event.offsetX);
  dragging = fingers.size < 2;
  overview = onOverview(event);
  if (dragging) scrub(event);
}

/** @param {PointerEvent} event */
function moved(event) {
  pointer = event.pointerType === "touch" ? null : event.offsetX;
  if (fingers.size === 2) pinch(event);
  else if (dragging) scrub(event);
  else if (event.pointerType !== "touch") explain(event);
  redraw();
}

/** @param {PointerEvent} event */
function released(event) {
  fingers.delete(event.pointerId);
  dragging = false;
}

/** Two fingers keep what is under them. @param {PointerEvent} event */
function pinch(event) {
  const before = fingers.get(event.pointerId);
  const other = [...fingers].find(([id]) => id !== event.pointerId)?.[1];
  if (before === undefined || other === undefined) return;
  fingers.set(event.pointerId, event.offsetX);
  const drawn = toDrawn(other);
  zoomTo((span.to - span.from) * (Math.max(20, Math.abs(before - other)) / Math.max(20, Math.abs(event.offsetX - other))), drawn, other);
}

function showAll() {
  const last = length();
  [span.from, span.to] = [-0.01 * last, Math.max(1.01 * last, 0.1)];
  redraw();
}

/** Length of the axis [drawn s]. */
const length = () => (state.seconds.length ? toFolded(folding, state.seconds[state.seconds.length - 1]) : 1);

/** Make room for new frames if everything was shown; the scale changes rarely, so that nothing moves under the pointer. */
function extend() {
  folding = foldingOf(state.seconds);
  const last = length();
  const whole = span.from <= 0 && last > span.to && !dragging;
  if (whole) span.to = ROOM * last;
  redraw();
}

const room = () => Math.max(1, wide - lanes.left - lanes.right);

/** @param {number} seconds @returns {number} CSS px */
export const toX = (seconds) => lanes.left + ((toFolded(folding, seconds) - span.from) / (span.to - span.from)) * room();

/** @param {number} x CSS px @returns {number} drawn s */
const toDrawn = (x) => span.from + ((x - lanes.left) / room()) * (span.to - span.from);

/** @param {number} x CSS px @returns {number} s */
export const toSeconds = (x) => unfolded(folding, toDrawn(x));

/** @param {PointerEvent} event */
function scrub(event) {
  if (!state.seconds.length) return;
  hideTip();
  if (overview) {
    const there = Math.min(1, Math.max(0, (event.offsetX - lanes.left) / room())) * length();
    zoomTo(span.to - span.from, there, lanes.left + room() / 2);
    return jump(nearestIndex(unfolded(folding, there)));
  }
  const reach = event.pointerType === "touch" ? FINGER_REACH : REACH;
  jump(stemNear(event.offsetX, reach)?.frame ?? nearestIndex(toSeconds(event.offsetX)));
}

/** Whether less than everything is shown. */
const isPart = () => span.to - span.from < 0.99 * length();

/** Whether a pointer is on the strip that shows everything while a part is shown. @param {PointerEvent} event */
const onOverview = (event) => isPart() && event.offsetY >= canvas.clientHeight - OVERVIEW;

/** @param {number} x @param {number} reach CSS px */
function stemNear(x, reach) {
  const near = clicks().filter((click) => Math.abs(toX(state.seconds[click.frame]) - x) <= reach);
  return near.sort((a, b) => Math.abs(toX(state.seconds[a.frame]) - x) - Math.abs(toX(state.seconds[b.frame]) - x))[0];
}

/** @param {PointerEvent} event */
function explain(event) {
  if (onOverview(event)) return showTip("All placements; press to go there", event.clientX, event.clientY - 10);
  const seconds = toSeconds(event.offsetX);
  const gap = gapsOf(folding).find(({ from, to }) => from < seconds && seconds < to);
  const lines = gap ? [`No frames for ${lengthWords(gap.to - gap.from)}, from ${timeText(gap.from, 1)} to ${timeText(gap.to, 1)}`] : aboutTime(seconds, event);
  showTip(lines.join("\n"), event.clientX, event.clientY - 10);
}

/** What became of a placement, in words. */
const STATES = { marked: "clicked", guess: "a guess", open: "not clicked yet", dismissed: "dismissed", unlikely: "another still object" };

/** What the timeline shows at a time. @param {number} seconds @param {PointerEvent} event */
function aboutTime(seconds, event) {
  const lines = [timeText(seconds, 2)];
  const click = stemNear(event.offsetX, REACH);
  if (click) lines.push(`${nameOf(click.id)} · ${click.residual_px === null ? click.state : residualText(click.residual_px)}`);
  const number = state.placements.findIndex((placement) => placement.start_s <= seconds && seconds <= placement.end_s);
  if (number >= 0) {
    const placement = state.placements[number];
    const { range_m, start_s, end_s, note } = placement;
    if (note) lines.push(note);
    lines.push(`placement ${number + 1}: ${range_m.toFixed(1)} m away, ${(end_s - start_s).toFixed(1)} s long, ${state.looking ? "" : STATES[stateOf(placement)]}`.replace(/, $/, ""));
  }
  const boxes = laneBoxes(canvas.clientHeight);
  if (event.offsetY > boxes.radar.bottom) lines.push(...aboutImage(seconds));
  else if (event.offsetY > boxes.radar.top) lines.push("Height: radar returns per scan");
  return lines;
}

/** @param {number} seconds */
function aboutImage(seconds) {
  const next = changes.seconds.findIndex((at) => at > seconds);
  const index = next < 0 ? changes.seconds.length - 1 : next - 1;
  if (index < 0) return ["Here will be how much the image changes"];
  return [`Height: how much the image changes from one frame to the next. Here the most changed hundredth of it changes by ${changes.grey_levels[index].toFixed(0)} of 255 grey levels.`];
}

/** @param {WheelEvent} event */
function wheeled(event) {
  event.preventDefault();
  const shift = event.shiftKey ? event.deltaY : event.deltaX;
  const factor = event.shiftKey ? 1 : Math.exp(event.deltaY * 0.0016);
  const width = (span.to - span.from) * factor;
  zoomTo(width, toDrawn(event.offsetX) + shift * 0.001 * width, event.offsetX);
}

/** Show this much of the axis, with a place of it at x. @param {number} shown drawn s @param {number} drawn drawn s @param {number} x CSS px */
function zoomTo(shown, drawn, x) {
  const last = length();
  const width = Math.min(1.02 * last, Math.max(0.5, shown));
  span.from = Math.min(1.01 * last - width, Math.max(-0.01 * last, drawn - ((x - lanes.left) / room()) * width));
  span.to = span.from + width;
  redraw();
}

/** Keep the current frame in view. */
function follow() {
  const now = state.seconds.length ? toFolded(folding, state.seconds[state.cursor]) : NaN;
  if (Number.isNaN(now) || (now >= span.from && now <= span.to) || dragging || fingers.size) return;
  const width = span.to - span.from;
  span.from = now - (state.live ? 0.9 : 0.1) * width;
  span.to = span.from + width;
}

function redraw() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    const ratio = window.devicePixelRatio || 1;
    const high = canvas.clientHeight;
    wide = canvas.clientWidth;
    const [width, height] = [Math.round(wide * ratio), Math.round(high * ratio)];
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    follow();
    const axis = { toX, from_s: unfolded(folding, span.from), to_s: unfolded(folding, span.to), isPart: isPart(), folding };
    drawLanes(pen, wide, high, axis, pointer);
    label();
  });
}

/** Update what a screen reader says. */
function label() {
  canvas.setAttribute("aria-valuemin", "0");
  canvas.setAttribute("aria-valuemax", String(Math.max(0, state.seconds.length - 1)));
  canvas.setAttribute("aria-valuenow", String(state.cursor));
  canvas.setAttribute("aria-valuetext", `frame ${state.cursor + 1}, ${timeText(state.seconds[state.cursor] ?? 0, 2)}`);
}
