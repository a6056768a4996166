/** What is drawn over the frame. Whoever draws something adds it here; image/image.js draws it. */

import { state } from "./state.js";

/** @typedef {"rectified"|"lens"|"contours"|"marks"|"candidates"|"proposal"|"cross"|"compared"} Name */
/** From the bottom to the top. @type {Name[]} */
const ORDER = ["rectified", "lens", "contours", "marks", "candidates", "proposal", "cross", "compared"];
/** @type {{name: Name, draw: (pen: CanvasRenderingContext2D) => void}[]} */
const layers = [];

/** Draw something over every frame. @param {Name} name @param {(pen: CanvasRenderingContext2D) => void} draw */
export function addLayer(name, draw) {
  layers.push({ name, draw });
  layers.sort((one, other) => ORDER.indexOf(one.name) - ORDER.indexOf(other.name));
}

/** Draw the layers of the frame on screen: a rectified one has its own and no marks. @param {CanvasRenderingContext2D} pen */
export function drawLayers(pen) {
  const isRectified = state.rectified || state.shown?.rectified === true;
  for (const { name, draw } of layers) if ((name === "rectified") === isRectified) draw(pen);
}
