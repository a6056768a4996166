/** The camera frame on its canvas, with the layers that others draw over it: size, zoom, pan and redrawing. */

import * as geometry from "./geometry.js";
import { emit, on, state } from "./state.js";

const { viewport } = geometry;
const pane = /** @type {HTMLElement} */ (document.getElementById("picture-pane"));
const picture = /** @type {HTMLCanvasElement} */ (document.getElementById("picture"));
export const marks = /** @type {HTMLCanvasElement} */ (document.getElementById("marks"));
const paper = /** @type {CanvasRenderingContext2D} */ (picture.getContext("2d", { alpha: false }));
const ink = /** @type {CanvasRenderingContext2D} */ (marks.getContext("2d"));
/** From this many device px per image px on, pixels are shown as squares; not below, since their edges snap to device px. */
const SQUARES_FROM = 8;
/** What is drawn over the frame, from the bottom to the top. @type {{draw: (pen: CanvasRenderingContext2D) => void, when: () => boolean}[]} */
const layers = [];
let drawPicture = false;
let drawInk = false;

export function startPicture() {
  new ResizeObserver(measure).observe(pane);
  watchRatio();
  on(["shown", "opening"], () => {
    if (state.shown) dropPreview();
    takeSize();
    redraw();
  });
  on(["view", "overlay", "selected", "layers", "hover", "placements", "theme", "candidates", "cross", "boxes", "lens", "proposals"], redrawMarks);
  on(["theme"], redraw);
  measure();
}

/** Draw something over every frame, above what was added before. @param {(pen: CanvasRenderingContext2D) => void} draw @param {() => boolean} when it is drawn */
export const addLayer = (draw, when) => layers.push({ draw, when });

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
  if (!geometry.resize(pane.clientWidth, pane.clientHeight)) return;
  for (const canvas of [picture, marks]) {
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

/** Take the size of the picture from the first frame. */
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
  drawPicture = true;
  redrawMarks();
}

function redrawMarks() {
  if (drawInk) return;
  drawInk = true;
  requestAnimationFrame(paint);
}

function paint() {
  if (drawPicture || !drawInk) paintPicture();
  drawPicture = drawInk = false;
  ink.setTransform(1, 0, 0, 1, 0, 0);
  ink.clearRect(0, 0, marks.width, marks.height);
  if (state.shown) for (const { draw, when } of layers) if (when()) draw(ink);
}

function paintPicture() {
  paper.fillStyle = getComputedStyle(document.documentElement).getPropertyValue("--ground").trim() || "#000";
  paper.fillRect(0, 0, picture.width, picture.height);
  const shown = state.shown ?? state.preview;
  if (!shown) return;
  paper.imageSmoothingEnabled = viewport.scale < SQUARES_FROM * shown.scale;
  paper.imageSmoothingQuality = state.playing ? "low" : "high";
  const [x, y] = geometry.toDevice(-0.5, -0.5);
  paper.drawImage(shown.bitmap, x, y, shown.width * viewport.scale, shown.height * viewport.scale);
}

/** Fit the picture into its box. */
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
