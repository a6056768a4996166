/**
 * Maps image pixels to the screen and back. Image pixels follow OpenCV: (0, 0) is the centre of the top-left pixel, the image's
 * edge is at -0.5. The half pixel appears only in `toDevice` and its inverse.
 */

import { growth } from "../base/colours.js";

/** Canvas boxes are multiples of this many CSS px, so that they end on device pixels at 100, 125, 150 and 200 %. */
const GRID = 4;
const MAX_SCALE = 64;
/** A field that is zoomed into fills this part of the box. */
const FILLS = 0.8;

export const viewport = {
  /** CSS size of the canvas box. */ width: GRID,
  height: GRID,
  /** Device px per CSS px. */ ratio: 1,
  /** Device px per px of a mark, which grows on a 4K monitor as the small text does. */ unit: 1,
  /** Device px per image px. */ scale: 1,
  /** Device px of the image's top-left edge. */ left: 0,
  top: 0,
  /** Whether the image is fitted, and stays so when the box changes. */ fitted: true,
  imageWidth: 1,
  imageHeight: 1,
};

/** Image px to device px of the canvas. @param {number} u @param {number} v @returns {[number, number]} */
export function toDevice(u, v) {
  return [viewport.left + (u + 0.5) * viewport.scale, viewport.top + (v + 0.5) * viewport.scale];
}

/** CSS px of the canvas to image px. @param {number} x @param {number} y @returns {[number, number]} */
export function toImage(x, y) {
  return [
    (x * viewport.ratio - viewport.left) / viewport.scale - 0.5,
    (y * viewport.ratio - viewport.top) / viewport.scale - 0.5,
  ];
}

/** Image px to CSS px of the canvas. @param {number} u @param {number} v @returns {[number, number]} */
export function toCss(u, v) {
  const [x, y] = toDevice(u, v);
  return [x / viewport.ratio, y / viewport.ratio];
}

/** Whether an image point is on the image. @param {number} u @param {number} v */
export function onImage(u, v) {
  return u >= -0.5 && v >= -0.5 && u <= viewport.imageWidth - 0.5 && v <= viewport.imageHeight - 0.5;
}

/** Adopt the size of the pane. @param {number} width @param {number} height CSS px @returns {boolean} whether anything changed */
export function resize(width, height) {
  const box = [Math.max(GRID, Math.floor(width / GRID) * GRID), Math.max(GRID, Math.floor(height / GRID) * GRID)];
  const ratio = window.devicePixelRatio || 1;
  if (box[0] === viewport.width && box[1] === viewport.height && ratio === viewport.ratio) return false;
  const middle = toImage(viewport.width / 2, viewport.height / 2);
  const before = viewport.ratio;
  [viewport.width, viewport.height] = box;
  viewport.ratio = ratio;
  viewport.unit = ratio * growth();
  if (viewport.fitted) fit();
  else {
    viewport.scale *= ratio / before;
    lookAt(middle[0], middle[1]);
  }
  return true;
}

/** Show all of the image. */
export function fit() {
  const width = viewport.width * viewport.ratio;
  const height = viewport.height * viewport.ratio;
  viewport.scale = Math.min(width / viewport.imageWidth, height / viewport.imageHeight);
  viewport.left = Math.round((width - viewport.imageWidth * viewport.scale) / 2);
  viewport.top = Math.round((height - viewport.imageHeight * viewport.scale) / 2);
  viewport.fitted = true;
}

/** Put an image point in the middle of the box. @param {number} u @param {number} v */
export function lookAt(u, v) {
  viewport.left = (viewport.width * viewport.ratio) / 2 - (u + 0.5) * viewport.scale;
  viewport.top = (viewport.height * viewport.ratio) / 2 - (v + 0.5) * viewport.scale;
  keepInside();
}

/** Zoom so that a field around an image point fills most of the box. @param {number} u @param {number} v @param {number} wide @param {number} high image px */
export function lookInto(u, v, wide, high) {
  const scale = FILLS * Math.min((viewport.width * viewport.ratio) / wide, (viewport.height * viewport.ratio) / high);
  viewport.fitted = false;
  viewport.scale = Math.min(MAX_SCALE * viewport.ratio, Math.max(fitScale(), scale));
  lookAt(u, v);
}

/** Zoom, keeping the image point under (x, y) in place. @param {number} factor @param {number} x @param {number} y CSS px */
export function zoomAt(factor, x, y) {
  const [u, v] = toImage(x, y);
  const smallest = fitScale();
  const scale = Math.min(MAX_SCALE * viewport.ratio, Math.max(smallest, viewport.scale * factor));
  if (scale <= smallest * 1.0001) return fit();
  viewport.fitted = false;
  viewport.scale = scale;
  viewport.left = x * viewport.ratio - (u + 0.5) * scale;
  viewport.top = y * viewport.ratio - (v + 0.5) * scale;
  keepInside();
}

/** Move the image. @param {number} dx @param {number} dy CSS px */
export function pan(dx, dy) {
  if (viewport.fitted) return;
  viewport.left += dx * viewport.ratio;
  viewport.top += dy * viewport.ratio;
  keepInside();
}

/** Zoom in CSS terms: screen px per image px. */
export const zoom = () => viewport.scale / viewport.ratio;

function fitScale() {
  return Math.min(
    (viewport.width * viewport.ratio) / viewport.imageWidth,
    (viewport.height * viewport.ratio) / viewport.imageHeight,
  );
}

/** Keep the image in the box: its edge may reach the middle, no farther. */
function keepInside() {
  const [halfWidth, halfHeight] = [(viewport.width * viewport.ratio) / 2, (viewport.height * viewport.ratio) / 2];
  viewport.left = Math.min(halfWidth, Math.max(halfWidth - viewport.imageWidth * viewport.scale, viewport.left));
  viewport.top = Math.min(halfHeight, Math.max(halfHeight - viewport.imageHeight * viewport.scale, viewport.top));
}
