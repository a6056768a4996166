/** Drawing boxes: drag to draw, drag inside the selected one to move it, drag a handle to resize it, click to select. Every correction is a keyframe. */

import { onImage, toCss, toImage, viewport } from "../picture/geometry.js";
import { toast } from "../shell/notices.js";
import { send } from "../shell/socket.js";
import { emit, on, stampOf, state } from "../shell/state.js";
import { goTo, pause, tellCursor } from "../time/player.js";
import { boxing, handleAt, HANDLES, selectBox, selectedBox, selectedTrack, shownBoxes } from "./boxes.js";

/** @typedef {import("./boxes.js").Edges} Edges */
/** @typedef {import("./boxes.js").Shown} Shown */

/** A press that moves farther than this is a drag [CSS px]. */
const THRESHOLD = 4;
/** A smaller box is taken for a slip of the hand [image px]. */
const LEAST = 3;
/** Changes by keys are sent once no key was pressed for this long [ms]. */
const REST = 250;

/** What is dragged: a box and the handle by which, "move" for all of it, "new" for one that is being drawn. @type {{x: number, y: number, u: number, v: number, box: Shown|null, by: (typeof HANDLES)[number]|"move"|"new", moved: boolean, frame: number}|null} */
let press = null;
/** The objects before a new one was sent, so as to select the new one. @type {Set<string>|null} */
let known = null;
let timer = 0;

export function startBoxing() {
  on(["view"], () => {
    const added = known && state.view?.boxes.find((track) => !known?.has(track.id));
    if (added) {
      known = null;
      selectBox(added.id);
    }
    if (boxing.selected && state.view && !selectedTrack()) selectBox(null);
    emit("boxes");
  });
  on(["cursor", "playing"], () => {
    flushBox();
    if (press && press.frame !== state.cursor) cancelBox();
  });
  addEventListener("pagehide", flushBox);
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape" && boxing.on && !document.querySelector("dialog[open]")) selectBox(null);
  });
}

/** Whether a box takes the pointer. @returns {boolean} */
export const boxesTake = () => boxing.on && state.shown !== null;

/** @param {number} x @param {number} y @param {number} reach CSS px */
export function pressBox(x, y, reach) {
  flushBox();
  if (state.playing) pause();
  const [u, v] = toImage(x, y);
  const box = selectedBox();
  const by = box ? handleNear(box, x, y, reach) ?? (inside(box.edges, u, v) ? "move" : null) : null;
  press = { x, y, u, v, box: by ? (box ?? null) : null, by: by ?? "new", moved: false, frame: state.cursor };
}

/** @param {number} x @param {number} y CSS px */
export function dragBox(x, y) {
  if (!press || (!press.moved && Math.hypot(x - press.x, y - press.y) < THRESHOLD)) return;
  press.moved = true;
  const [u, v] = toImage(x, y);
  const edges = draggedTo(u, v);
  const object = press.box ?? goneOn();
  boxing.draft = { id: object?.id ?? "", frame: state.shown?.index ?? -1, edges, label: object?.label ?? boxing.label, sent: false };
  emit("boxes");
}

export function dropBox() {
  const done = press;
  press = null;
  if (!done) return;
  if (!done.moved) return selectBox(boxAt(done.u, done.v)?.id ?? null);
  send_();
}

/** Forget what is being dragged. */
export function cancelBox() {
  if (!press) return;
  press = null;
  if (boxing.draft && !boxing.draft.sent) boxing.draft = null;
  emit("boxes");
}

/** The cursor over the picture. @param {number} x @param {number} y CSS px @returns {string} */
export function cursorOver(x, y) {
  const box = selectedBox();
  const handle = box && handleNear(box, x, y, 9);
  if (handle) return handle[0] && handle[1] ? ((handle[0] === "left") === (handle[1] === "top") ? "nwse-resize" : "nesw-resize") : handle[0] ? "ew-resize" : "ns-resize";
  return box && inside(box.edges, ...toImage(x, y)) ? "move" : "crosshair";
}

/** The selected object, if this frame has no box of it: a new box goes on with it. */
const goneOn = () => (selectedBox() && selectedBox()?.kind !== "draft" ? undefined : selectedTrack());

/** @param {number} u @param {number} v @returns {Edges} */
function draggedTo(u, v) {
  if (!press) return [0, 0, 0, 0];
  if (!press.box || press.by === "new") return ordered([press.u, press.v, u, v]);
  const [left, top, right, bottom] = press.box.edges;
  if (press.by === "move") return shifted(press.box.edges, u - press.u, v - press.v);
  const [across, along] = press.by;
  return ordered([across === "left" ? u : left, along === "top" ? v : top, across === "right" ? u : right, along === "bottom" ? v : bottom]);
}

/** Edges in their order and inside the picture. @param {Edges} edges @returns {Edges} */
function ordered([left, top, right, bottom]) {
  const [wide, high] = [viewport.imageWidth - 0.5, viewport.imageHeight - 0.5];
  const within = (/** @type {number} */ value, /** @type {number} */ most) => Math.round(100 * Math.min(most, Math.max(-0.5, value))) / 100;
  return [within(Math.min(left, right), wide), within(Math.min(top, bottom), high), within(Math.max(left, right), wide), within(Math.max(top, bottom), high)];
}

/** A box moved as a whole, as far as the picture goes. @param {Edges} edges @param {number} du @param {number} dv @returns {Edges} */
function shifted([left, top, right, bottom], du, dv) {
  const du_ = Math.min(viewport.imageWidth - 0.5 - right, Math.max(-0.5 - left, du));
  const dv_ = Math.min(viewport.imageHeight - 0.5 - bottom, Math.max(-0.5 - top, dv));
  return ordered([left + du_, top + dv_, right + du_, bottom + dv_]);
}

/** @param {Edges} edges @param {number} u @param {number} v */
const inside = ([left, top, right, bottom], u, v) => left <= u && u <= right && top <= v && v <= bottom;

/** The handle under the pointer. @param {Shown} box @param {number} x @param {number} y @param {number} reach CSS px */
function handleNear(box, x, y, reach) {
  const away = (/** @type {(typeof HANDLES)[number]} */ handle) => {
    const [cx, cy] = toCss(...handleAt(box.edges, handle));
    return Math.hypot(cx - x, cy - y);
  };
  const near = HANDLES.filter((handle) => away(handle) <= reach).sort((a, b) => away(a) - away(b));
  return near[0] ?? null;
}

/** The smallest box at a point. @param {number} u @param {number} v */
function boxAt(u, v) {
  const area = (/** @type {Shown} */ { edges: [left, top, right, bottom] }) => (right - left) * (bottom - top);
  return shownBoxes().filter((box) => inside(box.edges, u, v)).sort((a, b) => area(a) - area(b))[0];
}

/** Send the box that was drawn, moved or resized. */
async function send_() {
  const draft = boxing.draft;
  if (!draft || draft.sent) return;
  const [left, top, right, bottom] = draft.edges;
  if (right - left < LEAST || bottom - top < LEAST) {
    boxing.draft = null;
    return emit("boxes");
  }
  const image_time = stampOf(draft.frame);
  if (!draft.id) known = new Set(state.view?.boxes.map((track) => track.id));
  const message = draft.id ? { type: "box_moved", id: draft.id, image_time, box_px: draft.edges } : { type: "box_drawn", image_time, box_px: draft.edges, label: draft.label };
  if (await done(message)) draft.sent = true;
  else if (boxing.draft === draft) boxing.draft = null;
  tellCursor(); // the boxes of this frame come again, and replace the draft
  emit("boxes");
}

/** Send a change; say why it was refused. @param {Record<string, any>} message @returns {Promise<boolean>} whether it was taken */
async function done(message) {
  const refusal = await send(message);
  if (refusal) toast(refusal);
  return !refusal;
}

/** Send what was changed by keys. */
function flushBox() {
  if (!timer) return;
  clearTimeout(timer);
  timer = 0;
  send_();
}

/** Change the selected box of this frame a little; it is sent once nothing has changed for a moment. @param {(edges: Edges) => Edges} change */
function changeSoon(change) {
  const box = selectedBox();
  if (!box || !state.shown) return;
  clearTimeout(timer);
  boxing.draft = { id: box.id, frame: state.shown.index, edges: change(box.edges), label: box.label, sent: false };
  timer = window.setTimeout(flushBox, REST);
  emit("boxes");
}

/** Move the selected box. @param {number} du @param {number} dv image px */
export const nudgeBox = (du, dv) => changeSoon((edges) => shifted(edges, du, dv));

/** Set one edge of the selected box. @param {0|1|2|3} edge left, top, right, bottom @param {number} value image px */
export function setEdge(edge, value) {
  if (Number.isFinite(value)) changeSoon((edges) => ordered(/** @type {Edges} */ (edges.map((old, index) => (index === edge ? value : old)))));
}

/** A new box in the middle of what is on screen, to be moved and resized from there. */
export function newBox() {
  if (!boxesTake() || !state.shown) return;
  if (state.playing) return pause();
  flushBox();
  const [u, v] = toImage(viewport.width / 2, viewport.height / 2);
  const [left] = toImage(0, 0);
  const half = Math.min(viewport.imageWidth, 2 * (u - left)) / 16;
  if (!onImage(u, v)) return;
  const object = goneOn();
  boxing.draft = { id: object?.id ?? "", frame: state.shown.index, edges: ordered([u - half, v - 1.6 * half, u + half, v + 1.6 * half]), label: object?.label ?? boxing.label, sent: false };
  send_();
}

/** Take back what was said about the selected object in this frame; where nothing was, ask for all of it. */
export function forgetHere() {
  const track = selectedTrack();
  if (track) done({ type: "box_keyframe_removed", id: track.id, image_time: stampOf(state.cursor) });
}

/** Delete all boxes of the selected object. */
export function removeBox() {
  if (boxing.selected) done({ type: "box_removed", id: boxing.selected });
}

/** The selected object is hidden from this frame on. */
export function hideHere() {
  flushBox();
  if (boxing.selected) done({ type: "box_hidden", id: boxing.selected, image_time: stampOf(state.cursor) });
}

/** Give the selected object another class; it is also that of the next new box. @param {string} label */
export async function setLabel(label) {
  const text = label.trim();
  if (!text) return;
  boxing.label = text;
  const track = selectedTrack();
  if (track && track.label !== text) await done({ type: "box_labelled", id: track.id, label: text });
  emit("boxes");
}

/** Select the next object in this frame. */
export function nextBox() {
  const rows = shownBoxes();
  const at = rows.findIndex((box) => box.id === boxing.selected);
  if (rows.length) selectBox(rows[(at + 1) % rows.length].id);
}

/** Go to the next keyframe of the selected object, or to the one before. @param {1|-1} direction */
export function goToKeyframe(direction) {
  const frames = selectedTrack()?.keyframes ?? [];
  const ahead = direction > 0 ? frames.filter((frame) => frame > state.cursor) : frames.filter((frame) => frame < state.cursor).reverse();
  if (ahead.length) goTo(ahead[0]);
}

/** Why the selected object's box cannot be changed in this frame; "" if it can. */
export function withoutBox() {
  if (!boxing.on) return "Open Evaluate first (A)";
  return selectedTrack() ? "" : "No box is selected: click one, or draw one";
}
