/** Going to another placement or pair: bring the reflector into view, zoomed in where the radar expects it. */

import { clickIn, clicksOf, emit, isDismissed, isOffered, on, placementAt, state } from "../base/state.js";
import { goTo, pause } from "../time/player.js";
import { flushNudge } from "./clicking.js";
import { expectedHere } from "./cross.js";
import { lookAt, lookInto, viewport, zoom } from "./geometry.js";
import { fit, redraw } from "./image.js";

/** The frame to centre once it is shown. @type {number|null} */
let awaited = null;

export function startArriving() {
  on(["shown", "overlay", "view"], arrive);
  on(["playing"], () => (awaited = null));
}

/** What is shown around an expected reflector is this part of the image. */
const PART = 1 / 6;
/** A view in which that part is at least so wide is close enough already. */
const NEAR = 0.4;
/** Whether to zoom in where the reflector is expected. */
let closely = false;

/** Go to a frame. When zoomed in, centre the reflector if a mark or the calibration gives its position. @param {number} frame @param {boolean} [near] zoom in there */
export function comeTo(frame, near = false) {
  pause();
  awaited = viewport.fitted && !near ? null : frame;
  closely = near;
  goTo(frame);
  arrive();
}

/** Go to the next placement that wants a click, or to any other once all have one; or to the one before. @param {1|-1} direction */
export function toPlacement(direction) {
  flushNudge();
  const here = placementAt(state.cursor);
  const stay = state.placements.filter((found) => !isDismissed(found) && clicksOf(found).every((click) => click.state !== "excluded"));
  const open = stay.filter(isOffered);
  const wanted = direction > 0 && open.length ? open : stay.filter((found) => found !== here);
  const frames = [...new Set(wanted.map((found) => found.frame))].sort((a, b) => a - b);
  const ahead = direction > 0 ? frames.filter((frame) => frame > state.cursor) : frames.filter((frame) => frame < state.cursor).reverse();
  const next = ahead.length ? ahead[0] : direction > 0 ? frames[0] : frames[frames.length - 1];
  if (next !== undefined) comeTo(next, true);
}

function arrive() {
  if (awaited === null || state.shown?.index !== awaited) return;
  const mark = clickIn(awaited);
  if (mark && !(closely && viewport.fitted)) return centre(mark.u_px, mark.v_px);
  if (mark) return settle();
  if (state.view && !state.view.has_calibration && !state.view.reference) return whole();
  if (state.overlay?.index !== awaited) return;
  const [u, v] = expectedHere() ?? state.overlay.guesses[0]?.[0] ?? [];
  if (u === undefined || v === undefined) return whole();
  const wide = viewport.imageWidth * PART;
  if (closely && zoom() * wide < viewport.width * NEAR) lookInto(u, v, wide, viewport.imageHeight * PART);
  centre(u, v);
}

function settle() {
  awaited = null;
}

function whole() {
  awaited = null;
  fit();
}

/** @param {number} u @param {number} v */
function centre(u, v) {
  awaited = null;
  lookAt(u, v);
  redraw();
  emit("box");
}
