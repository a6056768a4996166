/**
 * The camera frame on its canvas, with the layers that are drawn over it: size, zoom, pan and redrawing; and the frame in words, for
 * those who do not see it.
 */

import { drawLayers } from "../base/layers.js";
import { keepClear } from "../base/notices.js";
import { clickIn, clicksIn, emit, isClicked, nameOf, on, placementAt, residualText, state, timeText } from "../base/state.js";
import * as geometry from "./geometry.js";

const { viewport } = geometry;
const pane = /** @type {HTMLElement} */ (document.getElementById("image-pane"));
const image = /** @type {HTMLCanvasElement} */ (document.getElementById("image"));
export const marks = /** @type {HTMLCanvasElement} */ (document.getElementById("marks"));
const context = /** @type {CanvasRenderingContext2D} */ (image.getContext("2d", { alpha: false }));
const ink = /** @type {CanvasRenderingContext2D} */ (marks.getContext("2d"));
/** From this many device px per image px on, pixels are shown as squares; not below, since their edges snap to device px. */
const SQUARES_FROM = 8;
/** Room around a mark that no toast covers [CSS px]. */
const MARK_PX = 24;
let paintFrame = false;
let drawInk = false;
const words = /** @type {HTMLElement} */ (document.getElementById("image-words"));
/** The image is described once nothing has changed for this long [ms], so that a screen reader can finish. */
const REST_MS = 500;
/** @type {Record<string, string>} */
const STATES = { inlier: "agrees with the others", outlier: "does not agree with the others", excluded: "excluded", unpaired: "no radar return belongs to it", pending: "not in the calibration yet" };
let timer = 0;

export function startImage() {
  new ResizeObserver(measure).observe(pane);
  watchRatio();
  on(["shown", "opening"], () => {
    if (state.shown) dropPreview();
    takeSize();
    redraw();
  });
  on(["view", "overlay", "selected", "layers", "hover", "placements", "theme", "candidates", "cross", "lens", "proposals"], redrawMarks);
  on(["theme"], redraw);
  keepClear(aroundMark);
  measure();
}

/** Where the mark of the frame on screen is on the page. */
function aroundMark() {
  const click = clickIn(state.shown?.index ?? -1);
  if (!click) return null;
  const pane = marks.getBoundingClientRect();
  const [x, y] = geometry.toCss(click.u_px, click.v_px);
  return { left: pane.left + x - MARK_PX, right: pane.left + x + MARK_PX, top: pane.top + y - MARK_PX, bottom: pane.top + y + MARK_PX };
}

/** Follow the ratio of device to CSS pixels, which changes with the browser's zoom and the monitor. */
function watchRatio() {
  matchMedia(`(resolution: ${window.devicePixelRatio}dppx)`).addEventListener(
    "change",
    () => {
      measure();
      watchRatio();
    },
    { once: true },
  );
}

function measure() {
  const below = Number.parseFloat(getComputedStyle(pane).paddingBottom); // room for the line on the frame
  if (!geometry.resize(pane.clientWidth, pane.clientHeight - below)) return;
  for (const canvas of [image, marks]) {
    canvas.width = Math.round(viewport.width * viewport.ratio);
    canvas.height = Math.round(viewport.height * viewport.ratio);
    canvas.style.width = `${viewport.width}px`;
    canvas.style.height = `${viewport.height}px`;
  }
  paint();
  emit("box");
}

/** Discard the preview once the first frame is shown. */
function dropPreview() {
  state.preview?.bitmap.close();
  state.preview = null;
}

/** Take the size of the image from the first frame. */
function takeSize() {
  const shown = state.shown ?? state.preview;
  if (!shown || (shown.width === viewport.imageWidth && shown.height === viewport.imageHeight)) return;
  viewport.imageWidth = shown.width;
  viewport.imageHeight = shown.height;
  geometry.fit();
  emit("box");
}

/** Draw everything with the next screen frame. */
export function redraw() {
  paintFrame = true;
  redrawMarks();
}

function redrawMarks() {
  if (drawInk) return;
  drawInk = true;
  requestAnimationFrame(paint);
}

function paint() {
  if (paintFrame || !drawInk) paintImage();
  paintFrame = drawInk = false;
  ink.setTransform(1, 0, 0, 1, 0, 0);
  ink.clearRect(0, 0, marks.width, marks.height);
  if (state.shown) drawLayers(ink);
}

function paintImage() {
  context.fillStyle = getComputedStyle(document.documentElement).getPropertyValue("--ground").trim() || "#000";
  context.fillRect(0, 0, image.width, image.height);
  const shown = state.shown ?? state.preview;
  if (!shown) return;
  context.imageSmoothingEnabled = viewport.scale < SQUARES_FROM * shown.scale;
  context.imageSmoothingQuality = state.playing ? "low" : "high";
  const [x, y] = geometry.toDevice(-0.5, -0.5);
  context.drawImage(shown.bitmap, x, y, shown.width * viewport.scale, shown.height * viewport.scale);
}

/** Fit the image into its box. */
export function fit() {
  geometry.fit();
  redraw();
  emit("box");
}

/** Zoom at a point of the box, by default in the middle. @param {number} factor @param {number} [x] @param {number} [y] CSS px */
export function zoomBy(factor, x = viewport.width / 2, y = viewport.height / 2) {
  geometry.zoomAt(factor, x, y);
  redraw();
  emit("box");
}

export function startDescribing() {
  on(["shown", "view", "overlay", "look", "selected", "placements", "playing", "cursor"], () => {
    clearTimeout(timer);
    if (!state.playing) timer = window.setTimeout(drawWords, REST_MS);
  });
}

function drawWords() {
  const text = state.looking ? lookWords() : imageWords();
  if (words.textContent !== text) words.textContent = text;
}

/** The frame, its placement and its marks, in sentences. */
function imageWords() {
  const index = state.shown?.index;
  if (index === undefined) return "";
  const returns = state.overlay?.index === index ? (state.overlay.returns?.length ?? 0) : 0;
  const others = (state.view?.clicks ?? []).filter((click) => click.frame !== index).length;
  return [moment(index), placementWords(index), ...markWords(index), plural(others, "mark in other frames", "marks in other frames"), plural(returns, "radar return in the image", "radar returns in the image")].filter(Boolean).join(". ") + ".";
}

/** The same for a recording without images. */
function lookWords() {
  const returns = state.look?.index === state.cursor ? state.look : null;
  return returns ? `${[moment(state.cursor), placementWords(state.cursor)].filter(Boolean).join(". ")}.` : "";
}

/** @param {number} index */
const moment = (index) => `Frame ${index + 1} of ${state.seconds.length}, ${timeText(state.seconds[index] ?? 0, 1)}`;

/** @param {number} index */
function placementWords(index) {
  const placement = placementAt(index);
  if (!placement) return state.placementsKnown ? "Between placements" : "";
  const marked = state.looking || isClicked(placement) ? "" : ", not clicked yet";
  return `Placement ${state.placements.indexOf(placement) + 1} of ${state.placements.length}, ${placement.range_m.toFixed(1)} m away${marked}`;
}

/** @param {number} index @returns {string[]} */
function markWords(index) {
  const here = clicksIn(index);
  if (here.length) return here.flatMap((click) => [oneMark(click), click.note]);
  const guess = state.overlay?.index === index ? state.overlay.guesses[0]?.[0] : undefined;
  return [guess ? `No mark in this frame; the reflector is expected at column ${guess[0].toFixed(0)}, row ${guess[1].toFixed(0)}` : "No mark in this frame"];
}

/** @param {import("../messages.js").ClickRow} click */
function oneMark(click) {
  const residual = click.residual_px === null ? "" : `, ${residualText(click.residual_px)} from where the radar expects it`;
  const guessed = click.mark === "untouched" ? "a guess that does not count" : (STATES[click.state] ?? click.state);
  const selected = click.id !== "" && click.id === state.selected ? ", selected" : "";
  return `Mark ${nameOf(click.id)} at column ${click.u_px.toFixed(1)}, row ${click.v_px.toFixed(1)}${selected}: ${guessed}${residual}`;
}

/** @param {number} count @param {string} one @param {string} many */
const plural = (count, one, many) => (count ? `${count} ${count === 1 ? one : many}` : "");
