/** The uncertainty in the image: lines on which a point at some distance may be this many pixels away from its drawn place. */

import { smallFont } from "../base/colours.js";
import { addLayer } from "../base/layers.js";
import { make } from "../base/notices.js";
import { tell } from "../base/socket.js";
import { emit, on, state } from "../base/state.js";
import { toDevice, viewport } from "./geometry.js";

/** @typedef {import("../messages.js").Uncertainty} Uncertainty */

/** @type {Uncertainty|null} */
let known = null;
/** The distance that is drawn; null for none. @type {string|null} */
let shown = null;
let asked = "";
const group = make("div", "", []);
const main = make("button", "chip", [make("kbd", "", "5"), "Uncertainty"]);
const HINT = "Where a point may appear: lines of equal uncertainty (95 %, in pixels) for points at 5, 20 or 60 m from the camera. (5)";
const COLOUR = "#ffd98a";

export function startContours() {
  addLayer("contours", drawContours);
  group.id = "contour-chips";
  group.setAttribute("role", "group");
  group.setAttribute("aria-label", "Uncertainty in the image");
  main.dataset.hint = HINT;
  main.dataset.contours = "";
  main.onclick = toggleContours;
  document.getElementById("layers")?.append(group);
  on(["view"], refresh);
  on(["connection"], () => {
    asked = "";
    refresh();
  });
  drawChips();
}

/** Show the contours, or hide them. */
export function toggleContours() {
  shown = shown === null ? "20 m" : null;
  refresh();
  drawChips();
  emit("layers");
}

/** @param {Uncertainty} message */
export function takeUncertainty(message) {
  known = message;
  drawChips();
  emit("layers");
}

/** Ask once per answer, while the contours are shown. */
function refresh() {
  group.hidden = !state.view?.has_calibration && shown === null;
  if (shown === null || !state.view || !state.connected) return;
  const answer = `${state.view.solved_revision} ${state.view.checking}`;
  if (asked === answer) return;
  asked = answer;
  tell({ type: "uncertainty" });
}

function drawChips() {
  main.setAttribute("aria-pressed", String(shown !== null));
  const folded = group.closest("details");
  if (folded && shown !== null) folded.open = true; // the distances are chosen there
  const chips = shown === null ? [] : (known?.maps ?? []).map((map) => {
    const chip = make("button", "chip", map.label);
    chip.dataset.contours = map.label;
    chip.dataset.hint = map.words;
    chip.setAttribute("aria-pressed", String(map.label === shown));
    chip.onclick = () => {
      shown = map.label;
      drawChips();
      emit("layers");
    };
    return chip;
  });
  const held = /** @type {HTMLElement|null} */ (document.activeElement)?.dataset.contours;
  group.replaceChildren(main, ...chips);
  if (held !== undefined) /** @type {HTMLElement|null} */ (group.querySelector(`[data-contours="${held}"]`))?.focus({ preventScroll: true });
}

/** Draw the lines with their labels, and say the same in words. @param {CanvasRenderingContext2D} pen */
function drawContours(pen) {
  const map = shown === null ? undefined : known?.maps.find((one) => one.label === shown);
  /** @type {string[]} */ const labels = [];
  /** @type {[number, number][]} */ const taken = [];
  for (const contour of map?.contours ?? []) {
    const line = contour.points_px.map(([u, v]) => toDevice(u, v));
    trace(pen, line);
    const at = labelPlace(line, taken);
    if (!at) continue;
    taken.push(at);
    labels.push(contour.label);
    label(pen, contour.label, at);
  }
  const words = labels.length ? `: lines at ${[...new Set(labels)].join(", ")}` : "";
  group.setAttribute("aria-label", `Uncertainty in the image${words}`);
}

/** @param {CanvasRenderingContext2D} pen @param {[number, number][]} line */
function trace(pen, line) {
  pen.beginPath();
  line.forEach(([x, y], index) => (index ? pen.lineTo(x, y) : pen.moveTo(x, y)));
  pen.lineJoin = "round";
  pen.lineWidth = 3.4 * viewport.unit;
  pen.strokeStyle = "rgb(0 0 0 / 45%)";
  pen.stroke();
  pen.lineWidth = 1.4 * viewport.unit;
  pen.strokeStyle = COLOUR;
  pen.stroke();
}

/** The middle of the part of a line that is in view, away from other labels; null if there is none. @param {[number, number][]} line @param {[number, number][]} taken @returns {[number, number]|null} */
function labelPlace(line, taken) {
  const margin = 24 * viewport.ratio;
  const [right, bottom] = [viewport.width * viewport.ratio - margin, viewport.height * viewport.ratio - margin];
  const inView = line.filter(([x, y]) => margin < x && x < right && margin * 2 < y && y < bottom - margin * 2);
  const middle = inView.length / 2;
  const ranked = inView.map((at, index) => ({ at, off: Math.abs(index - middle) })).sort((a, b) => a.off - b.off);
  const free = ranked.find(({ at }) => taken.every((other) => Math.hypot(at[0] - other[0], at[1] - other[1]) > 60 * viewport.ratio));
  return free?.at ?? null;
}

/** @param {CanvasRenderingContext2D} pen @param {string} words @param {[number, number]} at */
function label(pen, words, [x, y]) {
  pen.font = smallFont(viewport.ratio, "600");
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  const half = pen.measureText(words).width / 2 + 5 * viewport.unit;
  pen.fillStyle = "rgb(0 0 0 / 72%)";
  pen.fillRect(x - half, y - 8 * viewport.unit, 2 * half, 16 * viewport.unit);
  pen.fillStyle = COLOUR;
  pen.fillText(words, x, y);
  pen.textBaseline = "alphabetic";
}
