/** Small plots over the area of the picture: where the board was, residuals, and how uncertain a projection is. */

import { rampColour, themeColour } from "./colours.js";

/** @typedef {CanvasRenderingContext2D} Ink */
/** From this many corners on, a cell of the map is full. */
const FULL = 20;
/** The length of a typical arrow, as a part of the plot's width. */
const ARROW = 0.03;

/** Make a canvas as large as it is shown, with the picture's shape. @param {HTMLCanvasElement} canvas @param {number} wide @param {number} high of the picture @returns {Ink|null} */
function paper(canvas, wide, high) {
  const width = canvas.clientWidth;
  if (!width || !wide) return null;
  const ratio = window.devicePixelRatio || 1;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(((width * high) / wide) * ratio);
  const pen = /** @type {Ink} */ (canvas.getContext("2d"));
  pen.fillStyle = themeColour("ground");
  pen.fillRect(0, 0, canvas.width, canvas.height);
  return pen;
}

/** How many corners were in each part of the picture. @param {HTMLCanvasElement} canvas @param {import("./messages.js").LensCoverage} coverage @param {number} wide @param {number} high */
export function drawCoverage(canvas, coverage, wide, high) {
  const pen = paper(canvas, wide, high);
  if (!pen) return;
  const [width, height] = [canvas.width / coverage.columns, canvas.height / coverage.rows];
  const [full, line] = [themeColour("accent"), themeColour("line")];
  coverage.counts.forEach((count, index) => {
    const [x, y] = [(index % coverage.columns) * width, Math.floor(index / coverage.columns) * height];
    pen.globalAlpha = count ? 0.18 + 0.72 * Math.min(1, count / FULL) : 0;
    pen.fillStyle = full;
    pen.fillRect(x, y, width, height);
    pen.globalAlpha = 1;
    pen.strokeStyle = line;
    pen.strokeRect(x, y, width, height);
  });
}

/** The same over the frame: only what is still empty is veiled. @param {Ink} pen @param {import("./messages.js").LensCoverage} coverage @param {(u: number, v: number) => [number, number]} toDevice @param {number} wide @param {number} high */
export function veilEmpty(pen, coverage, toDevice, wide, high) {
  const [du, dv] = [wide / coverage.columns, high / coverage.rows];
  coverage.counts.forEach((count, index) => {
    const [u, v] = [(index % coverage.columns) * du - 0.5, Math.floor(index / coverage.columns) * dv - 0.5];
    const [[x, y], [right, bottom]] = [toDevice(u, v), toDevice(u + du, v + dv)];
    pen.fillStyle = count ? `rgb(87 182 242 / ${Math.round(2 + 10 * Math.min(1, count / FULL))}%)` : "rgb(13 16 20 / 46%)";
    pen.fillRect(x, y, right - x, bottom - y);
  });
}

/** Arrows from where corners were found to where the camera puts them, enlarged. @param {HTMLCanvasElement} canvas @param {import("./messages.js").LensResult["residuals"]} residuals @param {number} wide @param {number} high @returns {number} how many times they are enlarged */
export function drawResiduals(canvas, residuals, wide, high) {
  const pen = paper(canvas, wide, high);
  if (!pen || !residuals.length) return 0;
  const lengths = residuals.map(([, , du, dv]) => Math.hypot(du, dv)).sort((a, b) => a - b);
  const typical = lengths[Math.floor(0.75 * lengths.length)] || 1;
  const scale = canvas.width / wide;
  const times = rounded((ARROW * wide) / typical);
  for (const [u, v, du, dv] of residuals) {
    const [x, y] = [(u + 0.5) * scale, (v + 0.5) * scale];
    const length = Math.hypot(du, dv);
    pen.strokeStyle = rampColour(length / (3 * typical));
    pen.lineWidth = Math.max(1, window.devicePixelRatio || 1);
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(x + du * times * scale, y + dv * times * scale);
    pen.stroke();
  }
  return times;
}

/** A number with one digit, at or below another. @param {number} value */
function rounded(value) {
  const ten = 10 ** Math.floor(Math.log10(value));
  return Math.max(1, Math.floor(value / ten) * ten);
}

/** The standard deviation of a projection as colours, by its logarithm: it grows fast towards the corners. @param {HTMLCanvasElement} canvas @param {import("./messages.js").LensGrid} grid @param {number} wide @param {number} high @returns {[number, number]} the smallest and the largest value [px] */
export function drawUncertainty(canvas, grid, wide, high) {
  const known = grid.values.filter((value) => value !== null && Number.isFinite(value));
  const [low, most] = [Math.min(...known), Math.max(...known)];
  const pen = paper(canvas, wide, high);
  if (!pen || !known.length) return [low, most];
  const [width, height] = [canvas.width / grid.columns, canvas.height / grid.rows];
  grid.values.forEach((value, index) => {
    if (value === null) return;
    const [x, y] = [(index % grid.columns) * width, Math.floor(index / grid.columns) * height];
    pen.fillStyle = rampColour(most > low ? Math.log(value / low) / Math.log(most / low) : 0);
    pen.fillRect(Math.floor(x), Math.floor(y), Math.ceil(width), Math.ceil(height));
  });
  return [low, most];
}
