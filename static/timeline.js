// @ts-check
/** The timeline: placements, clicks as stems with the residual as height, radar activity; click to go there, wheel to zoom. */

import { drawLanes, lanes } from "./lanes.js";
import { jump, nearestIndex } from "./player.js";
import { hideTip, showTip } from "./notices.js";
import { clicks, on, state } from "./state.js";

const canvas = /** @type {HTMLCanvasElement} */ (document.getElementById("timeline"));
const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
/** A press this close to a stem goes to its frame [CSS px]. */
const REACH = 5;
/** How far beyond the last frame the timeline reaches while frames are added. */
const ROOM = 1.25;
/** The visible span of time [s]. */
export const span = { from: 0, to: 1 };
/** @type {number|null} */
let pointer = null;
let waiting = false;
let dragging = false;

export function startTimeline() {
  new ResizeObserver(redraw).observe(canvas);
  on(["recording"], showAll);
  on(["grown"], extend);
  on(["view", "placements", "shown", "selected", "cursor", "theme"], redraw);
  canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    dragging = true;
    canvas.setPointerCapture(event.pointerId);
    scrub(event);
  });
  canvas.addEventListener("pointermove", (event) => {
    pointer = event.offsetX;
    if (dragging) scrub(event);
    else explain(event);
    redraw();
  });
  canvas.addEventListener("pointerup", () => (dragging = false));
  canvas.addEventListener("pointercancel", () => (dragging = false));
  canvas.addEventListener("pointerleave", () => {
    pointer = null;
    hideTip();
    redraw();
  });
  canvas.addEventListener("wheel", zoom, { passive: false });
  canvas.addEventListener("dblclick", showAll);
}

export function showAll() {
  const last = state.seconds.length ? state.seconds[state.seconds.length - 1] : 1;
  [span.from, span.to] = [-0.01 * last, Math.max(1.01 * last, 0.1)];
  redraw();
}

/** Make room for new frames if everything was shown; the scale changes rarely, so that nothing moves under the pointer. */
function extend() {
  const last = state.seconds[state.seconds.length - 1];
  const whole = span.from <= 0 && last > span.to && !dragging;
  if (whole) span.to = ROOM * last;
  redraw();
}

/** @param {number} seconds */
export const toX = (seconds) => lanes.left + ((seconds - span.from) / (span.to - span.from)) * (canvas.clientWidth - lanes.left - lanes.right);

/** @param {number} x */
const toSeconds = (x) => span.from + ((x - lanes.left) / (canvas.clientWidth - lanes.left - lanes.right)) * (span.to - span.from);

/** @param {PointerEvent} event */
function scrub(event) {
  if (!state.seconds.length) return;
  hideTip();
  jump(stemNear(event.offsetX)?.frame ?? nearestIndex(toSeconds(event.offsetX)));
}

/** @param {number} x */
function stemNear(x) {
  const near = clicks().filter((click) => Math.abs(toX(state.seconds[click.frame]) - x) <= REACH);
  return near.sort((a, b) => Math.abs(toX(state.seconds[a.frame]) - x) - Math.abs(toX(state.seconds[b.frame]) - x))[0];
}

/** @param {PointerEvent} event */
function explain(event) {
  const seconds = toSeconds(event.offsetX);
  const click = stemNear(event.offsetX);
  const number = state.placements.findIndex((placement) => placement.start_s <= seconds && seconds <= placement.end_s);
  const lines = [`${seconds.toFixed(2)} s`];
  if (click) lines.push(`${click.id} · ${click.residual_px === null ? click.state : `${click.residual_px.toFixed(1)} px`}`);
  if (number >= 0) {
    const { range_m, start_s, end_s, note } = state.placements[number];
    if (note) lines.push(note);
    lines.push(`placement ${number + 1}: ${range_m.toFixed(1)} m away, ${(end_s - start_s).toFixed(1)} s long`);
  }
  showTip(lines.join("\n"), event.clientX, event.clientY - 10);
}

/** @param {WheelEvent} event */
function zoom(event) {
  event.preventDefault();
  const last = state.seconds[state.seconds.length - 1] ?? 1;
  const at = toSeconds(event.offsetX);
  const shift = event.shiftKey ? event.deltaY : event.deltaX;
  const factor = event.shiftKey ? 1 : Math.exp(event.deltaY * 0.0016);
  const width = Math.min(1.02 * last, Math.max(0.5, (span.to - span.from) * factor));
  const share = (at - span.from) / (span.to - span.from);
  span.from = at - share * width + shift * 0.001 * width;
  span.from = Math.min(1.01 * last - width, Math.max(-0.01 * last, span.from));
  span.to = span.from + width;
  redraw();
}

/** Keep the current frame in view. */
function follow() {
  const now = state.seconds[state.cursor];
  if (now === undefined || (now >= span.from && now <= span.to) || dragging) return;
  const width = span.to - span.from;
  span.from = now - (state.live ? 0.9 : 0.1) * width;
  span.to = span.from + width;
}

function redraw() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    follow();
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    drawLanes(pen, canvas.clientWidth, canvas.clientHeight, toX, span, pointer);
    label();
  });
}

/** Update what a screen reader says. */
function label() {
  canvas.setAttribute("aria-valuemin", "0");
  canvas.setAttribute("aria-valuemax", String(Math.max(0, state.seconds.length - 1)));
  canvas.setAttribute("aria-valuenow", String(state.cursor));
  canvas.setAttribute("aria-valuetext", `frame ${state.cursor + 1}, ${(state.seconds[state.cursor] ?? 0).toFixed(2)} s`);
}
