/**
 * A recording without images, seen from above: static returns of the whole recording, those of the last seconds, and the placements;
 * with its controls and the table of placements.
 */

import { attemptFirst } from "../base/actions.js";
import { degrees, sideways } from "../base/angles.js";
import { amplitudeColour, ink, smallFont, themeColour } from "../base/colours.js";
import { hideTip, make, showTip } from "../base/notices.js";
import { emit, on, placementAt, state, timeText } from "../base/state.js";
import { goTo, pause, tellCursor } from "../time/player.js";

/** @typedef {import("../messages.js").RadarReturn} Return */
/** @typedef {import("../messages.js").PlacementRow} Placement */
const canvas = /** @type {HTMLCanvasElement} */ (document.getElementById("birdseye"));
const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
/** A return or placement this close to the pointer is explained [CSS px]. */
const REACH = 9;
const RING = 13;
/** Angles are written below the line of text at the top [CSS px]. */
const LABELS_BELOW = 92;
/** Metres at the middle of the canvas, forward and left, and CSS px per metre. */
const view = { x: 5, y: 0, scale: 30, fitted: true };
let waiting = false;
/** @type {{x: number, y: number, moved: boolean}|null} */
let press = null;

function startBirdseye() {
  attemptFirst("fit", () => state.looking && fitView());
  attemptFirst("zoom-in", () => state.looking && zoomEye(1.25));
  attemptFirst("zoom-out", () => state.looking && zoomEye(0.8));
  new ResizeObserver(() => (view.fitted ? fitView() : redraw())).observe(canvas);
  on(["radar_map", "placements", "recording"], () => view.fitted && fitView());
  on(["look", "overlay", "cursor", "theme", "layers"], redraw);
  canvas.addEventListener("pointerdown", (event) => {
    press = { x: event.offsetX, y: event.offsetY, moved: false };
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", moved);
  canvas.addEventListener("pointerup", released);
  canvas.addEventListener("pointerleave", hideTip);
  canvas.addEventListener("dblclick", fitView);
  canvas.addEventListener("wheel", wheeled, { passive: false });
}

/** Show everything. @returns {true} it is done */
function fitView() {
  const { x_m: forward, y_m: left } = state.radarMap ?? { x_m: [], y_m: [] };
  const places = state.placements.map((placement) => placement.position_radar_m);
  const xs = [...forward, ...places.map(([x]) => x)].sort((a, b) => a - b);
  const ys = [...left, ...places.map(([, y]) => y)].sort((a, b) => a - b);
  const at = (/** @type {number[]} */ sorted, /** @type {number} */ share, /** @type {number} */ otherwise) => sorted[Math.round(share * (sorted.length - 1))] ?? otherwise;
  const [back, front] = [Math.min(-0.5, at(xs, 0.01, 0)), Math.max(2, at(xs, 0.99, 10), ...places.map(([x]) => x))];
  const side = Math.max(2, at(ys, 0.99, 5), -at(ys, 0.01, -5), ...places.map(([, y]) => Math.abs(y)));
  view.scale = Math.max(1, Math.min((canvas.clientHeight - 70) / (front - back), (canvas.clientWidth - 60) / (2 * side)));
  [view.x, view.y, view.fitted] = [(front + back) / 2, 0, true];
  redraw();
  return true;
}

/** @param {number} factor @param {number} [x] @param {number} [y] CSS px @returns {true} it is done */
function zoomEye(factor, x = canvas.clientWidth / 2, y = canvas.clientHeight / 2) {
  const [forward, left] = toRadar(x, y);
  view.scale = Math.min(2000, Math.max(1, view.scale * factor));
  view.fitted = false;
  const [nowForward, nowLeft] = toRadar(x, y);
  [view.x, view.y] = [view.x + forward - nowForward, view.y + left - nowLeft];
  redraw();
  return true;
}

/** Metres to CSS px. @param {number} x @param {number} y @returns {[number, number]} */
export const toCanvas = (x, y) => [canvas.clientWidth / 2 - (y - view.y) * view.scale, canvas.clientHeight / 2 - (x - view.x) * view.scale];

/** @param {number} x @param {number} y CSS px @returns {[number, number]} */
const toRadar = (x, y) => [view.x - (y - canvas.clientHeight / 2) / view.scale, view.y - (x - canvas.clientWidth / 2) / view.scale];

/** The returns of the last seconds, or beside an image those of its scan. @returns {Return[]} */
const returnsNow = () => (state.looking ? state.look?.returns : state.overlay?.returns) ?? [];

function redraw() {
  if (waiting || !canvas.clientWidth) return; // it is not on screen
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    if (state.lookOptions.map) drawMap();
    drawGrid();
    for (const seen of returnsNow()) drawReturn(seen);
    drawPlacements();
  });
}

/** The cells with static returns in the whole recording: fainter where something was for a short time only. */
function drawMap() {
  const map = state.radarMap;
  if (!map) return;
  const size = Math.max(2, map.cell_m * view.scale);
  const byAmplitude = state.lookOptions.colour === "amplitude" && map.snr_db.length > 0;
  map.x_m.forEach((x, index) => {
    const [px, py] = toCanvas(x, map.y_m[index]);
    pen.globalAlpha = Math.max(0.12, 0.75 * (1 + Math.log10(map.share[index]) / 3));
    pen.fillStyle = byAmplitude ? colourOf(map.snr_db[index]) : staying();
    pen.fillRect(px - size / 2, py - size / 2, size, size);
  });
  pen.globalAlpha = 1;
}

function drawGrid() {
  const rough = 75 / view.scale;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= rough) ?? rough;
  const farthest = Math.max(...[[0, 0], [canvas.clientWidth, 0], [0, canvas.clientHeight], [canvas.clientWidth, canvas.clientHeight]].map(([x, y]) => Math.hypot(...toRadar(x, y))));
  const [ox, oy] = toCanvas(0, 0);
  pen.strokeStyle = themeColour("line");
  pen.fillStyle = themeColour("faint");
  pen.font = smallFont();
  pen.lineWidth = 1;
  for (let range = step; range < farthest && range < 60 * step; range += step) {
    pen.beginPath();
    pen.arc(ox, oy, range * view.scale, 0, 2 * Math.PI);
    pen.stroke();
    text(`${Number(range.toPrecision(3))} m`, ox + 5, oy - range * view.scale - 5, "left");
  }
  for (let angle = -60; angle <= 60; angle += 15) {
    const [dx, dy] = [-Math.sin((angle * Math.PI) / 180), -Math.cos((angle * Math.PI) / 180)];
    pen.beginPath();
    pen.moveTo(ox, oy);
    pen.lineTo(ox + dx * farthest * view.scale, oy + dy * farthest * view.scale);
    pen.stroke();
    const far = Math.min(dy < 0 ? (oy - LABELS_BELOW) / -dy : Infinity, dx < 0 ? (ox - 26) / -dx : dx > 0 ? (canvas.clientWidth - 26 - ox) / dx : Infinity);
    if (angle && far > 90) text(`${Math.abs(angle)}° ${angle > 0 ? "L" : "R"}`, ox + dx * far, oy + dy * far, "center");
  }
  pen.fillStyle = themeColour("ink");
  pen.beginPath();
  pen.moveTo(ox, oy - 9);
  pen.lineTo(ox + 6, oy + 4);
  pen.lineTo(ox - 6, oy + 4);
  pen.fill();
}

/** @param {Return} seen */
function drawReturn([, , , , snr, isStill, x, y, , age]) {
  const [px, py] = toCanvas(x, y);
  const longest = Math.max(state.lookOptions.trail_s, 1e-3);
  pen.globalAlpha = 1 - 0.8 * Math.min(1, age / longest);
  pen.fillStyle = pen.strokeStyle = state.lookOptions.colour === "amplitude" && snr !== null ? colourOf(snr) : isStill ? ink.still : ink.moving;
  pen.beginPath();
  pen.lineWidth = 1.3;
  if (isStill) {
    pen.arc(px, py, 3.4, 0, 2 * Math.PI);
    pen.fill();
  } else {
    pen.moveTo(px, py - 4.5);
    pen.lineTo(px + 4, py + 3);
    pen.lineTo(px - 4, py + 3);
    pen.closePath();
    pen.stroke();
  }
  pen.globalAlpha = 1;
}

function drawPlacements() {
  const here = placementAt(state.cursor);
  state.placements.forEach((placement, index) => {
    const [px, py] = toCanvas(placement.position_radar_m[0], placement.position_radar_m[1]);
    const colour = themeColour(placement.note ? "attention" : "accent");
    pen.beginPath();
    pen.arc(px, py, RING, 0, 2 * Math.PI);
    pen.setLineDash(placement === here ? [] : [3, 3]);
    pen.lineWidth = placement === here ? 2.2 : 1.2;
    pen.strokeStyle = placement === here ? themeColour("ink") : colour;
    pen.stroke();
    pen.setLineDash([]);
    pen.font = smallFont(1, "600");
    pen.fillStyle = placement === here ? themeColour("ink") : colour;
    text(String(index + 1), px + RING, py - RING + 2, "left");
  });
}

/** Text with an edge, so that it can be read on anything. @param {string} words @param {number} x @param {number} y @param {CanvasTextAlign} align */
function text(words, x, y, align) {
  pen.save();
  pen.textAlign = align;
  pen.lineWidth = 3;
  pen.strokeStyle = themeColour("ground");
  pen.strokeText(words, x, y);
  pen.fillText(words, x, y);
  pen.restore();
}

/** @param {PointerEvent} event */
function moved(event) {
  if (!press) return explain(event);
  const [dx, dy] = [event.offsetX - press.x, event.offsetY - press.y];
  if (!press.moved && Math.hypot(dx, dy) < 4) return;
  [view.x, view.y, view.fitted] = [view.x + dy / view.scale, view.y + dx / view.scale, false];
  press = { x: event.offsetX, y: event.offsetY, moved: true };
  hideTip();
  redraw();
}

/** @param {PointerEvent} event */
function released(event) {
  const near = press?.moved ? undefined : placementNear(event);
  press = null;
  if (!near) return;
  pause();
  goTo(near.frame);
}

/** @param {MouseEvent} event */
function placementNear(event) {
  return state.placements.find(({ position_radar_m: [x, y] }) => Math.hypot(toCanvas(x, y)[0] - event.offsetX, toCanvas(x, y)[1] - event.offsetY) <= RING);
}

/** Explain the return, the placement or the place under the pointer. @param {PointerEvent} event */
function explain(event) {
  const lines = [];
  const [nearest] = returnsNow()
    .map((seen) => ({ seen, far: Math.hypot(toCanvas(seen[6], seen[7])[0] - event.offsetX, toCanvas(seen[6], seen[7])[1] - event.offsetY) }))
    .filter(({ far }) => far <= REACH)
    .sort((a, b) => a.far - b.far || a.seen[9] - b.seen[9]);
  if (nearest) {
    const [, , , doppler, snr, , x, y, z, age] = nearest.seen;
    lines.push([placeInWords(x, y, z), snr === null ? "" : `${snr.toFixed(0)} dB`, doppler === null ? "" : `${doppler.toFixed(2)} m/s`, age > 0.05 ? `${age.toFixed(1)} s ago` : ""].filter(Boolean).join(", "));
  }
  const near = placementNear(event);
  if (near) lines.push(describe(near));
  if (!lines.length) lines.push(placeInWords(...toRadar(event.offsetX, event.offsetY), 0));
  showTip(lines.join("\n"), event.clientX, event.clientY);
}

/** @param {number} x @param {number} y @param {number} z m */
const placeInWords = (x, y, z) => `${Math.hypot(x, y, z).toFixed(2)} m, ${sideways(degrees(y, x))}`;

/** A placement as one line. @param {Placement} placement */
function describe(placement) {
  const number = state.placements.indexOf(placement) + 1;
  const lasted = (placement.end_s - placement.start_s).toFixed(1);
  const amplitude = placement.snr_db === null ? "" : `, ${placement.snr_db.toFixed(0)} dB`;
  const above = placement.stands_out_db === null ? "" : ` (${placement.stands_out_db.toFixed(0)} dB above other returns at its range)`;
  return `Placement ${number} of ${state.placements.length}: ${placement.range_m.toFixed(1)} m, ${sideways(placement.azimuth_deg)}, ${lasted} s${amplitude}${above}`;
}

/** @param {WheelEvent} event */
function wheeled(event) {
  event.preventDefault();
  zoomEye(Math.exp(-event.deltaY * 0.0016), event.offsetX, event.offsetY);
}

/** Colour of what was there, whatever its amplitude. */
const staying = () => (document.documentElement.dataset.theme === "light" ? "rgb(96 110 126)" : "rgb(128 146 164)");

/** The amplitudes at both ends of the colours; null if the radar has none. @returns {[number, number]|null} */
function amplitudeRange() {
  const { low_db: low, high_db: high } = state.radarMap ?? { low_db: null, high_db: null };
  return low === null || high === null ? null : [low, high];
}

/** @param {number} amplitude dB */
function colourOf(amplitude) {
  const range = amplitudeRange();
  return range ? amplitudeColour((amplitude - range[0]) / Math.max(range[1] - range[0], 1e-9)) : staying();
}

const page = /** @type {HTMLElement} */ (document.getElementById("page-mark"));
const group = /** @type {HTMLElement} */ (document.getElementById("look-options"));
const legend = /** @type {HTMLElement} */ (document.getElementById("legend"));
const guide = /** @type {HTMLElement} */ (document.getElementById("guide"));
const TRAILS_S = [0, 2, 10];
/** Controls that need images. */
const NEED_IMAGES = ["undo", "redo"];

export function startLooking() {
  startBirdseye();
  on(["recording"], enter);
  on(["recording", "placements", "radar_map", "cursor", "layers", "theme"], draw);
  page.addEventListener("click", (event) => {
    const row = /** @type {Element} */ (event.target).closest("[data-placement]");
    if (!row || !state.looking) return;
    pause();
    goTo(state.placements[Number(row.getAttribute("data-placement"))].frame);
  });
}

/** Show what is there without images, once. */
function enter() {
  document.body.classList.toggle("looking", state.looking);
  if (!state.looking) return;
  const why = "There are no images in this recording: nothing can be clicked. Add the camera's file to calibrate.";
  for (const id of NEED_IMAGES) {
    const button = /** @type {HTMLButtonElement} */ (document.getElementById(id));
    button.disabled = true;
    button.dataset.hint = why;
  }
  const tab = /** @type {HTMLElement} */ (document.getElementById("tab-mark"));
  tab.textContent = "Placements";
  tab.click();
}

function draw() {
  if (!state.looking) return;
  drawOptions();
  drawLegend();
  drawTable();
  const here = placementAt(state.cursor);
  guide.hidden = !here;
  guide.classList.toggle("act", Boolean(here?.note));
  if (here) guide.textContent = [describe(here), here.note].filter(Boolean).join(": ");
}

function drawOptions() {
  const { trail_s: trail, colour, map, whole } = state.lookOptions;
  const next = TRAILS_S[(TRAILS_S.indexOf(trail) + 1) % TRAILS_S.length];
  const hasAmplitude = amplitudeRange() !== null;
  const chips = [
    chip(trail ? `Last ${trail} s` : "One scan", "For how long returns stay; they fade with age. Click for longer.", trail > 0, { trail_s: next }),
    chip("Whole recording", "Where there were static returns at any time: the stronger, the longer. What is faint came and went.", map, { map: !map, whole: !whole }),
  ];
  if (hasAmplitude) chips.push(chip("Amplitude", "Color by amplitude, else by speed: static returns are blue dots, moving ones orange triangles.", colour === "amplitude", { colour: colour === "amplitude" ? "speed" : "amplitude" }));
  group.replaceChildren(...chips);
}

/** @param {string} label @param {string} hint @param {boolean} pressed @param {Partial<typeof state.lookOptions>} change */
function chip(label, hint, pressed, change) {
  const made = make("button", "chip", label);
  made.dataset.hint = hint;
  made.setAttribute("aria-pressed", String(pressed));
  made.onclick = () => {
    Object.assign(state.lookOptions, change);
    emit("layers");
    tellCursor();
  };
  return made;
}

/** What the colours mean. */
function drawLegend() {
  const range = amplitudeRange();
  if (state.lookOptions.colour === "amplitude" && range) {
    const steps = Array.from({ length: 24 }, (_, index) => {
      const step = make("i", "", []);
      step.style.background = amplitudeColour(index / 23);
      return step;
    });
    legend.replaceChildren(`${range[0].toFixed(0)}`, make("span", "ramp", steps), `${range[1].toFixed(0)} dB`, make("span", "key", "● static"), make("span", "key", "△ moving"));
  } else legend.replaceChildren(make("span", "still", "● static"), make("span", "moving", "△ moving"));
}

function drawTable() {
  const here = placementAt(state.cursor);
  if (!state.placements.length) {
    const words = state.placementsKnown ? state.placementSummary : "Looking for placements in the radar data…";
    return page.replaceChildren(make("p", "none-found", words ? `${words}.` : "The radar data could not be searched."));
  }
  const heads = [["", ""], ["Time", "From when on, since the first scan"], ["Lasted", "How long it stood still"], ["Range", "Distance from the radar"], ["Azimuth", "Angle from straight ahead"], ["Amplitude", "Mean amplitude of its returns"], ["Above", "Above the strong static returns elsewhere at its range, while it stood"]];
  const head = make("tr", "", heads.map(([label, hint]) => {
    const cell = make("th", "", label);
    cell.scope = "col";
    if (hint) cell.dataset.hint = hint;
    return cell;
  }));
  const rows = state.placements.map((placement, index) => {
    const lasted = `${(placement.end_s - placement.start_s).toFixed(1)} s`;
    const cells = [String(index + 1), timeText(placement.start_s, 1), lasted, `${placement.range_m.toFixed(1)} m`, sideways(placement.azimuth_deg), decibels(placement.snr_db), decibels(placement.stands_out_db)];
    const row = make("tr", placement.note ? "row odd" : "row", cells.map((words) => make("td", "", words)));
    row.dataset.placement = String(index);
    row.dataset.hint = [describe(placement), placement.note].filter(Boolean).join("\n");
    row.setAttribute("aria-selected", String(placement === here));
    return row;
  });
  const top = page.scrollTop;
  page.replaceChildren(make("table", "pairs placements", [make("thead", "", [head]), make("tbody", "", rows)]));
  page.scrollTop = top;
  page.querySelector('[aria-selected="true"]')?.scrollIntoView({ block: "nearest" });
}

/** @param {number|null} value */
const decibels = (value) => (value === null ? "–" : `${value.toFixed(0)} dB`);
