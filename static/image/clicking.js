/**
 * Marks by pointer and keys: click to place, drag to move, arrow keys to nudge, S snaps to the reflector's apex that the image shows
 * within 15 px; a click on a candidate's number chooses it, a drag elsewhere pans, the wheel zooms at the cursor.
 */

import { toast } from "../base/notices.js";
import { offers } from "../base/offers.js";
import { send } from "../base/socket.js";
import { clickIn, clicks, clicksIn, emit, on, select, selectedClick, stampOf, state } from "../base/state.js";
import { leaveLive, pause } from "../time/player.js";
import { candidateNear, choose } from "./candidates.js";
import { onImage, pan, toCss, toImage, viewport } from "./geometry.js";
import { hold } from "./loupe.js";
import { marks, redraw, zoomBy } from "./image.js";
import { dragRuler, dropRuler, pressRuler, refusesMarks } from "./rectified.js";

/** A press that moves farther than this is a drag [CSS px]. */
const THRESHOLD = 4;
/** A press this close to a mark grabs it [CSS px]. */
const REACH = 9;
/** Nudges are sent once no key was pressed for this long [ms], so that they make one change and one undo step. */
const REST = 250;

/** @type {{x: number, y: number, lastX: number, lastY: number, u: number, v: number, moved: boolean, mark: import("../messages.js").ClickRow|null, candidate: number, pointer: number}|null} */
let press = null;
/** Whether it draws a line along an edge of the rectified image. */
let ruling = false;
/** @type {{click: import("../messages.js").ClickRow, u: number, v: number, timer: number}|null} */
let nudge = null;
/** The frame of a new mark that is to be selected, and the marks that it had before. @type {{index: number, known: Set<string>}|null} */
let awaited = null;
/** Number of the next new mark, until the server has given it an id. */
let nextDraft = 1;

export function startClicking() {
  marks.addEventListener("pointerdown", pressed);
  marks.addEventListener("pointermove", moved);
  marks.addEventListener("pointerup", released);
  marks.addEventListener("pointercancel", () => {
    press = null;
    ruling = false;
  });
  marks.addEventListener("pointerleave", () => hover(null));
  marks.addEventListener("wheel", wheeled, { passive: false });
  marks.addEventListener("contextmenu", (event) => event.preventDefault());
  addEventListener("pagehide", flushNudge);
  on(["cursor", "playing"], flushNudge);
  on(["view"], selectAwaited);
}

/** Position of an event in the canvas box. @param {MouseEvent} event @returns {[number, number]} CSS px */
function inBox(event) {
  const box = marks.getBoundingClientRect();
  return [event.clientX - box.left, event.clientY - box.top];
}

/** @param {PointerEvent} event */
function pressed(event) {
  if (event.button > 1 || !state.shown) return;
  flushNudge();
  leaveLive();
  const [x, y] = inBox(event);
  ruling = state.rectified && event.button === 0 && !event.shiftKey;
  if (ruling) {
    pressRuler(x, y);
    marks.setPointerCapture(event.pointerId);
    return /** @type {HTMLElement} */ (marks.parentElement).focus({ preventScroll: true });
  }
  const [u, v] = toImage(x, y);
  const mark = state.rectified ? null : event.button === 0 ? markNear(x, y) : null;
  const candidate = event.button === 0 && !mark && !state.rectified && !state.playing ? candidateNear(x, y) : -1;
  press = { x, y, lastX: x, lastY: y, u, v, moved: false, mark, candidate, pointer: event.button };
  marks.setPointerCapture(event.pointerId);
  /** @type {HTMLElement} */ (marks.parentElement).focus({ preventScroll: true });
}

/** The mark of this frame under the pointer, the nearest of several. @param {number} x @param {number} y @param {number} [reach] CSS px @returns {import("../messages.js").ClickRow|null} */
export function markNear(x, y, reach = REACH) {
  if (state.playing || state.rectified) return null;
  const away = (/** @type {import("../messages.js").ClickRow} */ click) => {
    const [cx, cy] = toCss(click.u_px, click.v_px);
    return Math.hypot(cx - x, cy - y);
  };
  const near = clicksIn(state.shown?.index ?? -1).filter((click) => away(click) <= reach);
  return near.sort((a, b) => away(a) - away(b))[0] ?? null;
}

/** @param {PointerEvent} event */
function moved(event) {
  const [x, y] = inBox(event);
  if (ruling) return dragRuler(x, y);
  const [u, v] = toImage(x, y);
  if (!press) {
    marks.classList.toggle("grab", markNear(x, y) !== null);
    marks.classList.toggle("pick", candidateNear(x, y) >= 0);
    return hover(onImage(u, v) ? { u, v } : null);
  }
  if (!press.moved && Math.hypot(x - press.x, y - press.y) < THRESHOLD) return;
  press.moved = true;
  if (press.mark) dragMark(press.mark, press.mark.u_px + u - press.u, press.mark.v_px + v - press.v);
  else {
    marks.classList.add("grabbing");
    pan(x - press.lastX, y - press.lastY);
    hover(null);
    redraw();
    emit("box");
  }
  [press.lastX, press.lastY] = [x, y];
}

/** @param {PointerEvent} event */
function released(event) {
  if (ruling) {
    ruling = false;
    return dropRuler();
  }
  const done = press;
  press = null;
  marks.classList.remove("grabbing");
  if (!done) return;
  const [x, y] = inBox(event);
  const [u, v] = toImage(x, y);
  if (done.mark && done.moved) {
    moveTo(done.mark, done.mark.u_px + u - done.u, done.mark.v_px + v - done.v);
    hold(null);
  } else if (done.mark) select(done.mark.id);
  else if (done.candidate >= 0 && !done.moved) choose(done.candidate);
  else if (!done.moved && done.pointer === 0 && onImage(done.u, done.v)) place(done.u, done.v);
}

/** @param {{u: number, v: number}|null} point */
function hover(point) {
  state.hover = point;
  emit("hover");
}

/**
 * Place a mark in the frame on screen and select it; other marks of the frame stay. Where a proposal is shown, it goes to the apex that the
 * frame shows next to it, if it does: one step, as the click is not placed before.
 * @param {number} u @param {number} v @param {{mark?: import("../messages.js").ClickRow["mark"], sigma_px?: number|null}} [how] clicked by a person, unless said otherwise
 */
export async function place(u, v, { mark = "clicked", sigma_px = null } = {}) {
  if (!state.shown) return;
  if (state.playing) return pause();
  if (refusesMarks()) return;
  flushNudge();
  leaveCross();
  const index = state.shown.index;
  const image_time = stampOf(index);
  const known = new Set(clicksIn(index).map((click) => click.id));
  const key = `new-${nextDraft++}`;
  const offer = mark === "clicked" ? offers.shown() : null;
  draft(key, { u, v, image_time, mark });
  awaited = { index, known };
  const { found } = offer ? await askApex({ image_time, pixel_px: [u, v], near: true }) : { found: null };
  if (found?.pixel_px) {
    [u, v] = found.pixel_px;
    [mark, sigma_px] = ["snapped", found.sigma_px];
    draft(key, { u, v, image_time, mark });
  }
  const sending = settle(key, { type: "click_placed", image_time, pixel_px: [u, v], mark, sigma_px });
  if (offer && state.cursor === index) offers.clicked(offer, sending);
  await sending;
  selectAwaited();
}

/** Select a new mark once the server has given it an id; its view may come after its confirmation. */
function selectAwaited() {
  if (!awaited) return;
  const { index, known } = awaited;
  const added = clicksIn(index).find((click) => click.id && !known.has(click.id));
  if (!added) return;
  awaited = null;
  if (state.shown?.index === index) select(added.id);
}

/** @param {import("../messages.js").ClickRow} click @param {number} u @param {number} v */
function dragMark(click, u, v) {
  const [inU, inV] = clamped(u, v);
  draft(click.id, { u: inU, v: inV });
  hold({ u: inU, v: inV });
}

/**
 * Move a mark; it then counts, also if it was a guess.
 * @param {import("../messages.js").ClickRow} click @param {number} u @param {number} v @param {{mark?: import("../messages.js").ClickRow["mark"], sigma_px?: number|null}} [how] by hand, unless said otherwise
 */
export async function moveTo(click, u, v, { mark = "moved", sigma_px = null } = {}) {
  if (refusesMarks()) return;
  const [inU, inV] = clamped(u, v);
  draft(click.id, { u: inU, v: inV });
  await settle(click.id, { type: "click_moved", id: click.id, pixel_px: [inU, inV], mark, sigma_px });
}

/** Clamp a point to the image. @param {number} u @param {number} v @returns {[number, number]} */
export function clamped(u, v) {
  const most = [viewport.imageWidth - 0.5, viewport.imageHeight - 0.5];
  return [Math.min(most[0], Math.max(-0.5, u)), Math.min(most[1], Math.max(-0.5, v))];
}

/** Put the keyboard's cross away; the next placement may bring it back. */
export function leaveCross() {
  if (!state.cross) return;
  state.cross = null;
  emit("cross");
}

/** Show a mark where the user left it, before the server confirms it. @param {string} key its id, or a name for a new one @param {import("../base/state.js").Draft} mark */
function draft(key, mark) {
  state.local.set(key, mark);
  emit("view");
}

/** Send the change, then show what the server has. @param {string} key @param {Record<string, any>} message @returns {Promise<string|null>} why it was refused */
async function settle(key, message) {
  const mine = state.local.get(key);
  const refusal = await send(message);
  if (state.local.get(key) === mine) state.local.delete(key);
  if (refusal) toast(refusal, "The mark was moved back.");
  emit("view");
  return refusal;
}

/** Move the click of this frame a little. @param {number} du @param {number} dv image px @returns {boolean} */
export function nudgeBy(du, dv) {
  const click = nudge?.click ?? clickIn(state.shown?.index ?? -1);
  if (!click || !click.id || state.playing || refusesMarks()) return false;
  const from = nudge ?? { u: click.u_px, v: click.v_px, timer: 0 };
  clearTimeout(from.timer);
  const [u, v] = clamped(from.u + du, from.v + dv);
  nudge = { click, u, v, timer: window.setTimeout(flushNudge, REST) };
  draft(click.id, { u, v });
  hold({ u, v });
  return true;
}

/** Send what was nudged. */
export function flushNudge() {
  if (!nudge) return;
  const { click, u, v, timer } = nudge;
  nudge = null;
  clearTimeout(timer);
  hold(null);
  moveTo(click, u, v);
}

/** @param {WheelEvent} event */
function wheeled(event) {
  event.preventDefault();
  const [x, y] = inBox(event);
  const unit = event.deltaMode === 1 ? 16 : event.deltaMode === 2 ? 400 : 1;
  zoomBy(Math.exp(-event.deltaY * unit * 0.0016), x, y);
  const [u, v] = toImage(x, y);
  hover(onImage(u, v) ? { u, v } : null);
}

/** Exclude the selected click, or include it again. */
export async function toggleExcluded() {
  const click = selectedClick();
  if (!click) return;
  flushNudge();
  const refusal = await send({ type: "click_excluded", id: click.id, excluded: click.state !== "excluded" });
  if (refusal) toast(refusal);
}

/** Delete the selected click. */
export async function removeSelected() {
  const click = selectedClick();
  if (!click) return;
  flushNudge();
  const refusal = await send({ type: "click_removed", id: click.id });
  if (refusal) toast(refusal);
  else if (!clicks().some((other) => other.id === state.selected)) select(null);
}

/** @param {"undo"|"redo"} type */
export async function turnBack(type) {
  if (!state.view) return;
  flushNudge();
  const refusal = await send({ type });
  if (refusal) toast(refusal);
}

/** The server's last answer, until it is used. @type {import("../messages.js").Snapped|null} */
let answer = null;

/** @param {import("../messages.js").Snapped} message */
export function takeSnapped(message) {
  answer = message;
}

/** @param {Omit<import("../messages.js").SnapWanted, "type">} wanted @returns {Promise<{found: import("../messages.js").Snapped|null, refusal: string|null|undefined}>} */
async function askApex(wanted) {
  answer = null;
  const refusal = await send({ type: "snap_wanted", ...wanted });
  return { found: refusal ? null : answer, refusal };
}

/** Whether the apex is being asked for. */
let busy = false;

/** Where to search: at the cross, or else at the mark. @returns {{id: string|null, u: number, v: number}|null} */
function snapsFrom() {
  const cross = state.cross;
  if (cross && cross.frame === state.cursor) return { id: null, u: cross.u, v: cross.v };
  const here = clickIn(state.cursor);
  return here ? { id: here.id, u: here.u_px, v: here.v_px } : null;
}

/** Why there is nothing to snap; "" if there is. */
export const withoutSnappable = () => (snapsFrom() ? "" : "There is no mark in this frame: click near the reflector first");

/** Ask for the apex, then move the mark there or place one. Nothing changes if there is no apex. */
export async function snap() {
  if (busy || state.playing || state.shown?.index !== state.cursor) return;
  busy = true;
  flushNudge();
  try {
    await snapFrom(state.cursor);
  } finally {
    busy = false;
  }
}

/** @param {number} index of the frame */
async function snapFrom(index) {
  const from = snapsFrom();
  if (!from || from.id === "") return;
  const { found, refusal } = await askApex({ image_time: stampOf(index), pixel_px: [from.u, from.v], id: from.id });
  if (refusal || !found) return toast(refusal ?? "The server did not answer.", "The mark stays where it is.");
  if (!found.pixel_px) return toast(found.words, "The mark stays where it is: move it closer, or set it by hand.", "snap");
  const [u, v] = found.pixel_px;
  const how = /** @type {const} */ ({ mark: "snapped", sigma_px: found.sigma_px });
  const here = clickIn(index);
  if (!from.id) return place(u, v, how);
  if (here?.id === from.id) return moveTo(here, u, v, how);
}
