/** Scatter plot of the residuals: how far right (du) and down (dv) each reprojection is from its click. An off-center cloud indicates a bias. */

import { ink, residualColour, smallFont, smallPx, themeColour } from "../base/colours.js";
import { make } from "../base/notices.js";
import { clicks, onPainted, select, state } from "../base/state.js";
import { goTo, pause } from "../time/player.js";

/** CSS px of the plot's side: smaller in a narrow panel. */
let side = 180;
const canvas = make("canvas", "", []);
const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));

export function startScatter() {
  canvas.id = "scatter";
  canvas.tabIndex = -1;
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", "Reprojection minus click");
  canvas.dataset.hint = "Reprojection minus click for every pair. An off-center cloud indicates a bias. Click a mark to go to its frame.";
  document.querySelector("#page-pose .pose")?.append(canvas);
  canvas.addEventListener("click", pressed);
  onPainted(["view", "selected", "theme", "box"], draw);
}

/** Half the width of the plot [px of the image], a round number that covers every inlier. */
function reach() {
  const agreeing = clicks().filter((click) => click.state === "inlier" && click.projected_px);
  const farthest = Math.max(1, ...agreeing.flatMap(offset).map(Math.abs));
  const power = 10 ** Math.floor(Math.log10(farthest));
  return [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= farthest) ?? farthest;
}

/** @param {import("../messages.js").ClickRow} click @returns {number[]} */
const offset = (click) => (click.projected_px ? [click.projected_px[0] - click.u_px, click.projected_px[1] - click.v_px] : []);

/** The plot in words. @param {import("../messages.js").ClickRow[]} shown */
function describe(shown) {
  const mean = [0, 1].map((axis) => shown.reduce((sum, click) => sum + offset(click)[axis], 0) / Math.max(shown.length, 1));
  return `Reprojection minus click: ${shown.length} clicks, on average ${mean[0].toFixed(1)} px right and ${mean[1].toFixed(1)} px down`;
}

/** Position of a click in the plot; clicks out of range are drawn on its edge. @param {import("../messages.js").ClickRow} click @param {number} most @returns {[number, number]} */
function place(click, most) {
  const [du, dv] = offset(click).map((value) => Math.min(1.06, Math.max(-1.06, value / most)));
  const half = side / 2;
  return [half + du * (half - 14), half + dv * (half - 14)];
}

function draw() {
  if (document.getElementById("page-check")?.hidden) return; // "box" comes when the page is shown
  side = (document.getElementById("panel")?.clientWidth ?? 0) > 440 ? 180 : 140;
  const ratio = window.devicePixelRatio || 1;
  canvas.width = canvas.height = Math.round(side * ratio);
  canvas.style.width = canvas.style.height = `${side}px`;
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, side, side);
  const most = reach();
  const half = side / 2;
  pen.strokeStyle = themeColour("line");
  pen.lineWidth = 1;
  for (const share of [0.5, 1]) ring(half, half, share * (half - 14));
  pen.beginPath();
  pen.moveTo(half, 6);
  pen.lineTo(half, side - 6);
  pen.moveTo(6, half);
  pen.lineTo(side - 6, half);
  pen.stroke();
  pen.fillStyle = themeColour("faint");
  pen.font = smallFont();
  pen.textAlign = "right";
  pen.fillText(`${most} px`, side - 5, smallPx() + 3); // in the corner, where no mark is
  const shown = clicks().filter((click) => click.projected_px);
  for (const click of shown) mark(click, most);
  canvas.setAttribute("aria-label", describe(shown));
}

/** @param {import("../messages.js").ClickRow} click @param {number} most */
function mark(click, most) {
  const [x, y] = place(click, most);
  const colour = click.state === "excluded" ? ink.grey : residualColour(click.residual_px);
  const chosen = click.id === state.selected;
  pen.beginPath();
  pen.arc(x, y, chosen ? 5 : 3.2, 0, 2 * Math.PI);
  pen.fillStyle = pen.strokeStyle = colour;
  pen.lineWidth = 1.4;
  if (click.state === "inlier") pen.fill();
  else pen.stroke();
  if (chosen) ring(x, y, 7.5);
}

/** @param {number} x @param {number} y @param {number} radius */
function ring(x, y, radius) {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.stroke();
}

/** @param {MouseEvent} event */
function pressed(event) {
  const most = reach();
  const near = clicks()
    .filter((click) => click.projected_px)
    .map((click) => ({ click, far: Math.hypot(place(click, most)[0] - event.offsetX, place(click, most)[1] - event.offsetY) }))
    .sort((a, b) => a.far - b.far)[0];
  if (!near || near.far > 10) return;
  pause();
  goTo(near.click.frame);
  select(near.click.id);
}
