// @ts-check
/** Going to another placement or pair: keep the zoom and bring the reflector into view. */

import { lookAt, viewport } from "./geometry.js";
import { fit, redraw } from "./picture.js";
import { goTo, pause } from "./player.js";
import { clickIn, emit, on, state } from "./state.js";

/** The frame to centre once it is shown. @type {number|null} */
let awaited = null;

export function startArriving() {
  on(["shown", "overlay", "view"], arrive);
  on(["playing"], () => (awaited = null));
}

/** Go to a frame. When zoomed in, centre the reflector if a mark or the calibration gives its position. @param {number} frame */
export function comeTo(frame) {
  pause();
  awaited = viewport.fitted ? null : frame;
  goTo(frame);
  arrive();
}

function arrive() {
  if (awaited === null || state.shown?.index !== awaited) return;
  const mark = clickIn(awaited);
  if (mark) return centre(mark.u_px, mark.v_px);
  if (state.view && !state.view.has_calibration && !state.view.reference) return whole();
  if (state.overlay?.index !== awaited) return;
  const guess = state.overlay.guesses[0];
  if (guess) centre(guess[0], guess[1]);
  else whole();
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
