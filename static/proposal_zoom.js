/** The view of a proposal: zoomed to the reflector's size, with room for the line on the frame. */

import { lookAt, lookInto, pan, toCss, viewport, zoom } from "./geometry.js";
import { redraw } from "./picture.js";
import { emit } from "./state.js";

/** What is shown of the picture around a proposal: so many widths of the reflector, and at least this part of the picture. */
const WIDTHS = 9;
const PART = 0.1;
/** Room below a proposal for the line on the frame, so that it does not cover the reflector [CSS px]. */
const BELOW = 120;

/** The middle of a view of a place, such that the picture fills the view if it can. @param {number} at image px @param {number} box CSS px @param {number} size image px */
function within(at, box, size) {
  const half = box / zoom() / 2;
  return half > size / 2 ? (size - 1) / 2 : Math.min(size - 0.5 - half, Math.max(half - 0.5, at));
}

/** Zoom into the place that is taken of a proposal. @param {import("./proposals.js").Offer} offer */
export function zoomInto({ row, place }) {
  const field = Math.max(WIDTHS * row.width_px, PART * viewport.imageWidth);
  lookInto(place.u_px, place.v_px, field, field);
  lookAt(within(place.u_px, viewport.width, viewport.imageWidth), within(place.v_px, viewport.height, viewport.imageHeight));
  pan(0, Math.min(0, viewport.height - BELOW - toCss(place.u_px, place.v_px)[1]));
  redraw();
  emit("box");
}
