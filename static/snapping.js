/** S: the mark, or the keyboard's cross, goes to the reflector's apex that the picture shows within 15 px; the server finds it. */

import { askApex } from "./apex.js";
import { flushNudge, moveTo, place } from "./clicking.js";
import { toast } from "./notices.js";
import { clickIn, stampOf, state } from "./state.js";

let busy = false;

/** Where to search: at the cross, or else at the mark. @returns {{id: string|null, u: number, v: number}|null} */
function start() {
  const cross = state.cross;
  if (cross && cross.frame === state.cursor) return { id: null, u: cross.u, v: cross.v };
  const here = clickIn(state.cursor);
  return here ? { id: here.id, u: here.u_px, v: here.v_px } : null;
}

/** Why there is nothing to snap; "" if there is. */
export const withoutSnappable = () => (start() ? "" : "There is no mark in this frame: click near the reflector first");

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
  const from = start();
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
