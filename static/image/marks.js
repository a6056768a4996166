/**
 * Marks on the frame: click = cross, reprojection = ring, their residual = line, excluded = hollow, predicted = dashed,
 * 95 % of good residuals = ellipse, radar returns = dots (static) and triangles (moving); and the chips that switch them.
 */

import { ink, residualColour, smallFont } from "../base/colours.js";
import { addLayer } from "../base/layers.js";
import { make } from "../base/notices.js";
import { clicks, clicksIn, emit, isOffered, on, placementsAt, state } from "../base/state.js";
import { toCss, toDevice, viewport, zoom } from "./geometry.js";
import { toggleRectified, withoutRectified } from "./rectified.js";

/** @typedef {CanvasRenderingContext2D} Context2D */
/** @typedef {import("../messages.js").ClickRow} Click */

/** Within this distance of a mark, the pointer counts as being at the reflector [CSS px]. */
const CLOSE = 36;
/** The line on what to do covers so much of the lower edge [CSS px]. */
const PILL = 60;
/** From this many screen px per image px on, the view counts as being close to the reflector. */
const CLOSE_ZOOM = 2;

/** What the server says of the frame on screen, once it is known. */
const overlayHere = () => (state.overlay?.index === state.shown?.index ? state.overlay : null);

/** The returns, what is predicted and the clicks of the frame on screen. @param {Context2D} pen */
function drawMarks(pen) {
  const index = state.shown?.index ?? -1;
  const overlay = overlayHere();
  if (state.layers.returns && overlay?.returns) drawReturns(pen, overlay.returns);
  if (state.layers.predictions && overlay) for (const [[u, v], range] of overlay.guesses) if (isOpen(index, range)) drawGuess(pen, u, v);
  if (state.layers.predictions && state.view?.advice && !state.view.verdict.done) drawAdvice(pen, state.view.advice);
  const here = clicks();
  if (state.layers.others) for (const click of here) if (click.frame !== index) drawOther(pen, click);
  for (const click of clicksIn(index)) drawClick(pen, click);
}

/** Whether a placement in a frame still wants a click. @param {number} index @param {number} range its own [m] */
const isOpen = (index, range) => placementsAt(index).some((one) => Math.abs(one.range_m - range) < 0.01 && isOffered(one));

/** @param {Context2D} pen @param {import("../messages.js").RadarReturn[]} returns */
function drawReturns(pen, returns) {
  const size = 3.2 * viewport.unit;
  for (const [u, v, , , , isStill] of returns) {
    const [x, y] = toDevice(u, v);
    pen.beginPath();
    if (isStill) pen.arc(x, y, size, 0, 2 * Math.PI);
    else triangle(pen, x, y, size * 1.25);
    pen.fillStyle = isStill ? ink.still : ink.moving;
    pen.globalAlpha = 0.85;
    pen.fill();
    pen.globalAlpha = 1;
    pen.lineWidth = viewport.unit;
    pen.strokeStyle = ink.edge;
    pen.stroke();
  }
}

/** @param {Context2D} pen @param {number} x @param {number} y @param {number} size */
function triangle(pen, x, y, size) {
  pen.moveTo(x, y - size);
  pen.lineTo(x + size * 0.9, y + size * 0.7);
  pen.lineTo(x - size * 0.9, y + size * 0.7);
  pen.closePath();
}

/** Where the radar and the pose expect the reflector. @param {Context2D} pen @param {number} u @param {number} v */
function drawGuess(pen, u, v) {
  const [x, y] = toDevice(u, v);
  const dashes = [4 * viewport.unit, 3.5 * viewport.unit];
  outlined(pen, ink.guess, 1.4, () => pen.arc(x, y, 15 * viewport.unit, 0, 2 * Math.PI), dashes);
}

/** The best next placement: a dashed diamond, since it lies on the ground. @param {Context2D} pen @param {import("../messages.js").Advice} advice */
function drawAdvice(pen, advice) {
  if (advice.best.may_stop) return;
  const [x, y] = toDevice(advice.best.pixel_px[0], advice.best.pixel_px[1]);
  if (x < 0 || y < 0 || x > pen.canvas.width || y > pen.canvas.height) return; // its words alone would point at nothing
  const [wide, high] = [18 * viewport.unit, 9 * viewport.unit];
  outlined(pen, ink.guess, 1.4, () => {
    pen.moveTo(x - wide, y);
    pen.lineTo(x, y - high);
    pen.lineTo(x + wide, y);
    pen.lineTo(x, y + high);
    pen.closePath();
  }, [4 * viewport.unit, 3.5 * viewport.unit]);
  pen.font = smallFont(viewport.ratio);
  pen.textAlign = "center";
  pen.lineWidth = 3 * viewport.unit;
  pen.strokeStyle = ink.edge;
  const words = "best next placement";
  const half = pen.measureText(words).width / 2 + 4 * viewport.unit;
  const middle = Math.max(half, Math.min(pen.canvas.width - half, x));
  const low = y + high + 13 * viewport.unit;
  const at = low < pen.canvas.height - PILL * viewport.unit ? low : y - high - 4 * viewport.unit;
  pen.strokeText(words, middle, at);
  pen.fillStyle = ink.guess;
  pen.fillText(words, middle, at);
}

/** A click of another frame, small and dimmed. @param {Context2D} pen @param {Click} click */
function drawOther(pen, click) {
  const [x, y] = toDevice(click.u_px, click.v_px);
  const arm = 4 * viewport.unit;
  pen.globalAlpha = click.id !== "" && click.id === state.selected ? 1 : 0.65;
  const colour = residualColour(click.residual_px);
  outlined(pen, colour, 1.3, () => cross(pen, x, y, arm, 0), isHollow(click) ? [2 * viewport.unit, 2 * viewport.unit] : []);
  pen.globalAlpha = 1;
}

/** The click of this frame with its reprojection, residual and ellipse. @param {Context2D} pen @param {Click} click */
function drawClick(pen, click) {
  const [x, y] = toDevice(click.u_px, click.v_px);
  const closeUp = looksClosely(click);
  if (click.projected_px) drawReprojection(pen, click, x, y, closeUp);
  const hollow = isHollow(click);
  const arm = (closeUp ? 22 : 13) * viewport.unit;
  const gap = (closeUp ? 10 : 3) * viewport.unit;
  if (closeUp) pen.globalAlpha = 0.9;
  if (hollow) outlined(pen, ink.click, 1.2, () => hollowCross(pen, x, y, arm, gap));
  else outlined(pen, ink.click, 1.6, () => cross(pen, x, y, arm, gap), [], closeUp ? 1.4 : 2);
  pen.globalAlpha = 1;
}

/** Whether a click is not used: excluded, or a guess that nobody has looked at. @param {Click} click */
const isHollow = (click) => click.state === "excluded" || click.state === "untouched";

/** Whether the user is looking at the reflector itself; the marks then do not cover it. @param {Click} click */
function looksClosely(click) {
  if (!viewport.fitted && zoom() >= CLOSE_ZOOM) return true;
  if (!state.hover) return false;
  const [x, y] = toCss(state.hover.u, state.hover.v);
  const [cx, cy] = toCss(click.u_px, click.v_px);
  return Math.hypot(x - cx, y - cy) < CLOSE;
}

/** @param {Context2D} pen @param {Click} click @param {number} x @param {number} y @param {boolean} closeUp */
function drawReprojection(pen, click, x, y, closeUp) {
  const ring = /** @type {[number, number]} */ (click.projected_px);
  const [px, py] = toDevice(ring[0], ring[1]);
  const colour = residualColour(click.residual_px);
  if (state.layers.ellipses && click.ellipse) {
    const [major, minor, angle] = click.ellipse;
    const ellipse = () => pen.ellipse(px, py, major * viewport.scale, minor * viewport.scale, angle, 0, 2 * Math.PI);
    pen.beginPath();
    ellipse();
    pen.fillStyle = "rgb(255 255 255 / 7%)";
    if (!closeUp) pen.fill();
    pen.globalAlpha = closeUp ? 0.6 : 1;
    outlined(pen, ink.ring, 1, ellipse, [], closeUp ? 1 : 2);
    pen.globalAlpha = 1;
  }
  const length = Math.hypot(px - x, py - y);
  const radius = (closeUp ? 12 : 7) * viewport.unit;
  if (length > radius) {
    const end = (length - radius) / length;
    const start = Math.min(end, closeUp ? (10 * viewport.unit) / length : 0);
    outlined(pen, colour, 2, () => {
      pen.moveTo(x + (px - x) * start, y + (py - y) * start);
      pen.lineTo(x + (px - x) * end, y + (py - y) * end);
    });
  }
  outlined(pen, colour, closeUp ? 1.2 : 2, () => pen.arc(px, py, radius, 0, 2 * Math.PI), [], closeUp ? 1 : 2);
}

/**
 * Stroke a path with a dark edge below it, so that it is visible on any image.
 * @param {Context2D} pen @param {string} colour @param {number} width CSS px @param {() => void} path @param {number[]} [dashes] @param {number} [edge] CSS px
 */
export function outlined(pen, colour, width, path, dashes = [], edge = 2) {
  pen.setLineDash(dashes);
  pen.beginPath();
  path();
  pen.lineWidth = (width + edge) * viewport.unit;
  pen.strokeStyle = ink.edge;
  pen.stroke();
  pen.lineWidth = width * viewport.unit;
  pen.strokeStyle = colour;
  pen.stroke();
  pen.setLineDash([]);
}

/** @param {Context2D} pen @param {number} x @param {number} y @param {number} arm @param {number} gap */
export function cross(pen, x, y, arm, gap) {
  for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
    pen.moveTo(x + dx * gap, y + dy * gap);
    pen.lineTo(x + dx * arm, y + dy * arm);
  }
}

/** @param {Context2D} pen @param {number} x @param {number} y @param {number} arm @param {number} gap */
function hollowCross(pen, x, y, arm, gap) {
  const half = 2 * viewport.unit;
  for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
    const [from, to] = [gap, arm];
    pen.moveTo(x + dx * from - dy * half, y + dy * from - dx * half);
    pen.lineTo(x + dx * to - dy * half, y + dy * to - dx * half);
    pen.lineTo(x + dx * to + dy * half, y + dy * to + dx * half);
    pen.lineTo(x + dx * from + dy * half, y + dy * from + dx * half);
    pen.closePath();
  }
}

/** @typedef {keyof typeof state.layers} Layer */
/** @type {[Layer, string, string][]} */
const LAYERS = [
  ["returns", "Returns", "Radar returns of the nearest scan, projected into the image: dots are static, triangles are moving. (1)"],
  ["others", "All clicks", "Clicks in all other frames, colored by residual. (2)"],
  ["ellipses", "95 %", "Ellipses around the reprojections that contain 95 % of the clicks of good pairs. (3)"],
  ["predictions", "Predicted", "Expected position of the reflector in this placement (circle) and best next placement (diamond). (4)"],
];
const group = /** @type {HTMLElement} */ (document.getElementById("layers"));

export function startLayers() {
  addLayer("marks", drawMarks);
  LAYERS.forEach(([layer, label, hint], index) => {
    const chip = make("button", "chip", [make("kbd", "", String(index + 1)), label]);
    chip.dataset.layer = layer;
    chip.dataset.hint = hint;
    chip.onclick = () => toggleLayer(layer);
    group.append(chip);
  });
  const rectify = make("button", "chip", [make("kbd", "", "U"), "Rectified"]);
  rectify.dataset.layer = "rectified";
  rectify.onclick = toggleRectified;
  group.append(rectify);
  on(["layers", "lens"], drawChips);
  drawChips();
}

/** @param {Layer} layer */
export function toggleLayer(layer) {
  state.layers[layer] = !state.layers[layer];
  emit("layers");
}

function drawChips() {
  for (const chip of /** @type {NodeListOf<HTMLElement>} */ (group.querySelectorAll("button[data-layer]"))) {
    const layer = chip.dataset.layer;
    chip.setAttribute("aria-pressed", String(layer === "rectified" ? state.rectified : state.layers[/** @type {Layer} */ (layer)]));
    if (layer !== "rectified") continue;
    const why = withoutRectified();
    chip.hidden = why !== "";
    chip.dataset.hint = "The image without the lens's distortion, with a grid: straight edges must be straight. Drag a line along one to compare. (U)";
  }
}
