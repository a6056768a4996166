/**
 * The result of calibrating the lens: the model and why, how well it fits, every view, what was left out; and the plots over the area of
 * the image: where the board was, residuals, uncertainty.
 */

import { ask, content, saveFile } from "../base/asking.js";
import { ink, rampColour, themeColour } from "../base/colours.js";
import { addLayer } from "../base/layers.js";
import { make, toast } from "../base/notices.js";
import { send } from "../base/socket.js";
import { emit, on, said, state } from "../base/state.js";
import { toDevice, viewport } from "../image/geometry.js";
import { goTo, pause } from "../time/player.js";

/** A corner in the frame: where, its residual, and whether it was used. @typedef {[number, number, number, number, boolean]} Corner */
export const lensResult = make("section", "lens-result", []);
const page = /** @type {HTMLElement} */ (document.getElementById("page-lens"));
const residuals = make("canvas", "", []);
const uncertainty = make("canvas", "", []);
const residualWords = make("figcaption", "", "");
const uncertaintyWords = make("figcaption", "", "");
/** @type {import("../messages.js").LensResult|null} */
let result = null;
/** The corners of the frame on screen. @type {{frame: number, number: number, corners: Corner[]}} */
let shown = { frame: -1, number: 0, corners: [] };
let drawn = "";
/** Residuals of this length have the last colour [px]. */
const LARGE_PX = 1;

export function startLensResult() {
  addLayer("lens", drawLensMarks);
  lensResult.setAttribute("aria-label", "Calibrated lens");
  lensResult.hidden = true;
  residuals.setAttribute("role", "img");
  uncertainty.setAttribute("role", "img");
  on(["shown", "lens", "box"], lookUp);
  on(["box", "theme"], drawPlots);
  lensResult.addEventListener("click", (event) => {
    const row = event.target instanceof Element ? event.target.closest("[data-frame]") : null;
    if (!(row instanceof HTMLElement)) return;
    pause();
    goTo(Number(row.dataset.frame));
  });
}

/** @param {import("../messages.js").LensResult} message */
export function takeLensResult(message) {
  result = message;
}

export function drawLensResult() {
  lensResult.hidden = !result;
  if (!result) return;
  const text = JSON.stringify([result.number, state.lens?.in_use]);
  if (text === drawn) return;
  drawn = text;
  const use = make("button", "", state.lens?.in_use ? "In use" : "Use these intrinsics");
  use.disabled = Boolean(state.lens?.in_use);
  use.dataset.hint = "The clicks are solved with this lens from now on. Undo takes that back.";
  use.onclick = useLens;
  const save = make("button", "second", "Save camera.yaml");
  save.onclick = () => saveCamera(false);
  lensResult.replaceChildren(
    make("h2", "", "Calibrated lens"),
    make("p", "lens-about", `${result.board} · ${result.camera.model} · ${result.camera.field}`),
    ...(result.choice ? [make("p", "lens-choice", result.choice)] : []),
    figures(result),
    ...result.warnings.map((one) => make("p", "lens-warning", [said(one.message), make("small", "", ` ${said(one.hint)}`)])),
    ...(state.lens?.in_use ? [] : [parameters(result.camera)]),
    make("div", "acts", [use, save]),
    make("div", "lens-plots", [make("figure", "", [residuals, residualWords]), ...(result.uncertainty ? [make("figure", "", [uncertainty, uncertaintyWords])] : [])]),
    ...(result.uncertainty ? [make("p", "lens-note", result.unseen)] : []),
    ...(result.trials.length > 1 ? [trials(result)] : []),
    views(result),
    ...(result.left_out.length ? [leftOut(result)] : []),
  );
  drawPlots();
  lookUp();
}

/** Solve with the calibrated lens. */
async function useLens() {
  const refusal = await send({ type: "lens_use" });
  if (refusal) toast(refusal);
}

/** Download intrinsics. @param {boolean} inUse those in use, else the calibrated ones */
export async function saveCamera(inUse) {
  const unsaved = await saveFile(`api/camera.yaml${inUse ? "?in_use" : ""}`, "camera.yaml");
  if (unsaved) toast(unsaved.reason, "Try again.");
}

/** @param {import("../messages.js").LensCamera} camera */
export function parameters(camera) {
  return make("dl", "lens-parameters", camera.parameters.map(({ label, value, unit }) => make("div", "", [make("dt", "", label), make("dd", "", [value, unit ? make("span", "unit", ` ${unit}`) : ""])])));
}

/** @param {number|null} value */
const px = (value) => (value === null ? "–" : value.toFixed(2));

/** @param {import("../messages.js").LensResult} found */
function figures(found) {
  /** @type {[string, string, string, string][]} */
  const rows = [
    ["RMS", px(found.rms_px), "px", "Root mean square distance between found and projected corners."],
    ["RMS of left-out views", px(found.held_out_rms_px), "px", "The same for each view with the lens calibrated from all others: what to expect of a view that was not used. Much more than the RMS means too few views or a lens model that is too rich."],
    ["Views", String(found.views.length), "", "Images that were used."],
    ["Left out", String(found.left_out.length), "", "Images that were not used; below with the reason."],
  ];
  return make("dl", "lens-figures", rows.map(([name, value, unit, hint]) => {
    const one = make("div", "figure", [make("dt", "", name), make("dd", "", [value, make("span", "unit", unit)])]);
    one.dataset.hint = hint;
    one.tabIndex = 0;
    return one;
  }));
}

/** @param {string} caption @param {string[]} heads @param {(string|HTMLElement)[][]} rows @param {(number|null)[]} frames of the rows @param {string} [name] */
function table(caption, heads, rows, frames, name = "") {
  const body = rows.map((cells, index) => {
    const row = make("tr", frames[index] === null ? "" : "row", cells.map((cell) => make("td", "", [cell])));
    if (frames[index] !== null) row.dataset.frame = String(frames[index]);
    return row;
  });
  return make("details", `lens-table ${name}`.trim(), [make("summary", "", caption), make("table", "", [make("thead", "", [make("tr", "", heads.map((head) => make("th", "", head)))]), make("tbody", "", body)])]);
}

/** @param {import("../messages.js").LensResult} found */
function views(found) {
  return table(`${found.views.length} views, those that fit worst first`, ["Image", "RMS", "left out"], found.views.map((view) => [frameButton(view.name), px(view.rms_px), px(view.held_out_rms_px)]), found.views.map((view) => view.frame));
}

/** @param {import("../messages.js").LensResult} found */
function leftOut(found) {
  return table(`${found.left_out.length} images left out`, ["Image", "Why"], found.left_out.map((one) => [frameButton(one.name), one.reason]), found.left_out.map((one) => one.index), "reasons");
}

/** @param {import("../messages.js").LensResult} found */
function trials(found) {
  const rows = found.trials.map(({ trial, note, chosen }) => [make(chosen ? "strong" : "span", "", trial.model), px(trial.rms_px), px(trial.held_out_rms_px), chosen ? "chosen" : note]);
  return table("Lens models that were tried", ["Model", "RMS", "left out", ""], rows, rows.map(() => null), "trials");
}

/** @param {string} name */
const frameButton = (name) => make("button", "lens-frame", name);

function drawPlots() {
  if (!result || page.hidden) return;
  const { width_px: wide = 0, height_px: high = 0 } = state.recording ?? {};
  const times = drawResiduals(residuals, result.residuals, wide, high);
  residualWords.textContent = `Residuals of the corners, ${times} times enlarged. ${result.pattern}`;
  residuals.setAttribute("aria-label", residualWords.textContent);
  if (!result.uncertainty) return;
  const [low, most] = drawUncertainty(uncertainty, result.uncertainty, wide, high);
  uncertaintyWords.textContent = `Standard deviation of a projection: ${Number(low.toPrecision(2))} (blue) to ${Number(most.toPrecision(2))} px (red).`;
  uncertainty.setAttribute("aria-label", uncertaintyWords.textContent);
}

/** Get the corners of the frame on screen, while the tab is open. */
async function lookUp() {
  const frame = state.shown?.index ?? -1;
  if (page.hidden || !result || (shown.frame === frame && shown.number === result.number)) return;
  shown = { frame, number: result.number, corners: [] };
  if (!result.views.some((view) => view.frame === frame)) return emit("hover");
  const { answer } = await ask(`api/board_corners.json?${frame}`);
  const found = answer && (await content(answer.json()));
  if (!found || shown.frame !== frame) return;
  shown.corners = found;
  emit("hover");
}

/** While the tab is open: where the board was not yet, and the corners of this frame. @param {CanvasRenderingContext2D} pen */
function drawLensMarks(pen) {
  if (page.hidden) return;
  const lens = state.lens;
  if (lens?.coverage && lens.stage === "searching") veilEmpty(pen, lens.coverage, toDevice, viewport.imageWidth, viewport.imageHeight);
  if (shown.frame !== state.shown?.index) return;
  const radius = 3.4 * viewport.unit;
  for (const [u, v, du, dv, used] of shown.corners) {
    const [x, y] = toDevice(u, v);
    for (const [colour, width] of /** @type {[string, number][]} */ ([[ink.edge, 3], [used ? rampColour(Math.hypot(du, dv) / LARGE_PX) : ink.grey, 1.5]])) {
      pen.strokeStyle = colour;
      pen.lineWidth = width * viewport.unit;
      pen.beginPath();
      pen.arc(x, y, radius, 0, 2 * Math.PI);
      if (!used) pen.moveTo(x - radius, y - radius), pen.lineTo(x + radius, y + radius);
      pen.stroke();
    }
  }
}

/** @typedef {CanvasRenderingContext2D} Context2D */
/** From this many corners on, a cell of the map is full. */
const FULL = 20;
/** The length of a typical arrow, as a part of the plot's width. */
const ARROW = 0.03;

/** Make a canvas as large as it is shown, with the image's shape. @param {HTMLCanvasElement} canvas @param {number} wide @param {number} high of the image @returns {Context2D|null} */
function sizedContext(canvas, wide, high) {
  const width = canvas.clientWidth;
  if (!width || !wide) return null;
  const ratio = window.devicePixelRatio || 1;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(((width * high) / wide) * ratio);
  const pen = /** @type {Context2D} */ (canvas.getContext("2d"));
  pen.fillStyle = themeColour("ground");
  pen.fillRect(0, 0, canvas.width, canvas.height);
  return pen;
}

/** Call for each value of a grid with its column and row. @param {number[][]} grid @param {(value: number, column: number, row: number) => void} draw */
const eachCell = (grid, draw) => grid.forEach((values, row) => values.forEach((value, column) => draw(value, column, row)));

/** How many corners were in each part of the image. @param {HTMLCanvasElement} canvas @param {import("../messages.js").Coverage} coverage @param {number} wide @param {number} high */
export function drawCoverage(canvas, coverage, wide, high) {
  const pen = sizedContext(canvas, wide, high);
  if (!pen) return;
  const { counts } = coverage;
  const [width, height] = [canvas.width / counts[0].length, canvas.height / counts.length];
  const [full, line] = [themeColour("accent"), themeColour("line")];
  eachCell(counts, (count, column, row) => {
    const [x, y] = [column * width, row * height];
    pen.globalAlpha = count ? 0.18 + 0.72 * Math.min(1, count / FULL) : 0;
    pen.fillStyle = full;
    pen.fillRect(x, y, width, height);
    pen.globalAlpha = 1;
    pen.strokeStyle = line;
    pen.strokeRect(x, y, width, height);
  });
}

/** The same over the frame: only what is still empty is veiled. @param {Context2D} pen @param {import("../messages.js").Coverage} coverage @param {(u: number, v: number) => [number, number]} toDevice @param {number} wide @param {number} high */
function veilEmpty(pen, coverage, toDevice, wide, high) {
  const { counts } = coverage;
  const [du, dv] = [wide / counts[0].length, high / counts.length];
  eachCell(counts, (count, column, row) => {
    const [u, v] = [column * du - 0.5, row * dv - 0.5];
    const [[x, y], [right, bottom]] = [toDevice(u, v), toDevice(u + du, v + dv)];
    pen.fillStyle = count ? `rgb(87 182 242 / ${Math.round(2 + 10 * Math.min(1, count / FULL))}%)` : "rgb(13 16 20 / 46%)";
    pen.fillRect(x, y, right - x, bottom - y);
  });
}

/** Arrows from where corners were found to where the camera puts them, enlarged. @param {HTMLCanvasElement} canvas @param {import("../messages.js").LensResult["residuals"]} residuals @param {number} wide @param {number} high @returns {number} how many times they are enlarged */
function drawResiduals(canvas, residuals, wide, high) {
  const pen = sizedContext(canvas, wide, high);
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

/** The standard deviation of a projection as colours, by its logarithm: it grows fast towards the corners. @param {HTMLCanvasElement} canvas @param {import("../messages.js").ImageGrid} grid @param {number} wide @param {number} high @returns {[number, number]} the smallest and the largest value [px] */
function drawUncertainty(canvas, grid, wide, high) {
  const { sigma_px } = grid;
  const known = sigma_px.flat().filter((value) => value !== null && Number.isFinite(value));
  const [low, most] = [Math.min(...known), Math.max(...known)];
  const pen = sizedContext(canvas, wide, high);
  if (!pen || !known.length) return [low, most];
  const [width, height] = [canvas.width / sigma_px[0].length, canvas.height / sigma_px.length];
  eachCell(sigma_px, (value, column, row) => {
    if (value === null) return;
    const [x, y] = [column * width, row * height];
    pen.fillStyle = rampColour(most > low ? Math.log(value / low) / Math.log(most / low) : 0);
    pen.fillRect(Math.floor(x), Math.floor(y), Math.ceil(width), Math.ceil(height));
  });
  return [low, most];
}
