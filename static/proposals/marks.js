/** Draws a proposal on the frame: a dashed cross with its 95 % ring, and faint numbers at the other places once one was asked for. */

import { ink, smallFont } from "../base/colours.js";
import { toDevice, viewport } from "../image/geometry.js";
import { cross, outlined } from "../image/marks.js";
import { shownOffer } from "./proposals.js";

/** A ring of this many standard deviations contains 95 %. */
const RING = 2.45;
/** Arms begin this far from the middle, in widths of the reflector, so that they do not cover it. */
const CLEAR = 0.3;
const RADIUS = 8;

/** @param {CanvasRenderingContext2D} pen */
export function drawProposal(pen) {
  const offer = shownOffer();
  if (!offer) return;
  const { unit, scale } = viewport;
  offer.row.places.forEach((place, index) => {
    if (offer.isOpen && index !== offer.number) drawOther(pen, place, index + 1);
  });
  const [x, y] = toDevice(...offer.place.pixel_px);
  const radius = Math.max(3 * unit, RING * offer.place.sigma_px * scale);
  const gap = Math.max(4 * unit, radius + 2 * unit, CLEAR * offer.row.width_px * scale);
  outlined(pen, ink.guess, 1.2, () => pen.arc(x, y, radius, 0, 2 * Math.PI), [], 1.6);
  outlined(pen, ink.click, 1.8, () => cross(pen, x, y, gap + 17.6 * unit, gap), [4 * unit, 3 * unit]);
}

/** @param {CanvasRenderingContext2D} pen @param {import("../messages.js").ProposalPlace} place @param {number} number */
function drawOther(pen, place, number) {
  const { ratio, unit } = viewport;
  const [x, y] = toDevice(...place.pixel_px);
  pen.globalAlpha = 0.7;
  outlined(pen, ink.guess, 1, () => pen.arc(x, y, 3 * unit, 0, 2 * Math.PI), [2 * unit, 2 * unit], 1.4);
  const [bx, by] = [x + 11 * unit, y - 11 * unit];
  pen.beginPath();
  pen.arc(bx, by, RADIUS * unit, 0, 2 * Math.PI);
  pen.fillStyle = "rgb(20 26 32 / 75%)";
  pen.fill();
  pen.font = smallFont(0.9 * ratio, "600");
  [pen.textAlign, pen.textBaseline] = ["center", "middle"];
  pen.fillStyle = "#ffffff";
  pen.fillText(String(number), bx, by + 0.5 * unit);
  pen.textBaseline = "alphabetic";
  pen.globalAlpha = 1;
}
