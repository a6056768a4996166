// @ts-check
/** Draws the timeline, lane by lane: ruler, placements with residual stems, radar activity, and the current frame. */

import { ink, residualColour, themeColour } from "./colours.js";
import { clicks, isClicked, state } from "./state.js";

export const lanes = { left: 12, right: 14, ruler: 17, activity: 18, gap: 5, bottom: 6 };
/** Returns per slice of time, from the server; empty until known. @type {{step_s: number, returns: number[]}} */
export const activity = { step_s: 1, returns: [] };

/** @typedef {CanvasRenderingContext2D} Ink */

/**
 * Draw everything.
 * @param {Ink} pen @param {number} width @param {number} height CSS px @param {(seconds: number) => number} toX
 * @param {{from: number, to: number}} span @param {number|null} pointer
 */
export function drawLanes(pen, width, height, toX, span, pointer) {
  pen.clearRect(0, 0, width, height);
  if (!state.seconds.length) return;
  const base = height - lanes.bottom - lanes.activity - lanes.gap;
  drawRuler(pen, width, height, toX, span);
  drawPlacements(pen, base, toX);
  drawActivity(pen, height, toX, span);
  pen.fillStyle = themeColour("line-strong");
  pen.fillRect(lanes.left, base, width - lanes.left - lanes.right, 1);
  for (const click of clicks()) drawStem(pen, click, toX(state.seconds[click.frame]), base);
  if (pointer !== null) {
    pen.fillStyle = themeColour("line-strong");
    pen.fillRect(Math.round(pointer), lanes.ruler, 1, height - lanes.ruler);
  }
  drawCursor(pen, height, toX(state.seconds[state.cursor] ?? 0));
}

/** @param {Ink} pen @param {number} width @param {number} height @param {(s: number) => number} toX @param {{from: number, to: number}} span */
function drawRuler(pen, width, height, toX, span) {
  const rough = ((span.to - span.from) / width) * 90;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= rough) ?? 10 * power;
  pen.font = "10.5px " + themeColour("mono");
  pen.textBaseline = "middle";
  pen.textAlign = "center";
  for (let tick = Math.ceil(Math.max(0, span.from) / step); tick * step <= span.to; tick += 1) {
    const x = toX(tick * step);
    pen.fillStyle = themeColour("line");
    pen.fillRect(Math.round(x), lanes.ruler - 3, 1, height - lanes.ruler + 3);
    pen.fillStyle = themeColour("faint");
    const text = step < 1 ? (tick * step).toFixed(Math.ceil(-Math.log10(step))) : String(Math.round(tick * step));
    if (x > 10 && x < width - 12) pen.fillText(tick === 0 ? "0 s" : text, x, 6.5);
  }
}

/** @param {Ink} pen @param {number} base @param {(s: number) => number} toX */
function drawPlacements(pen, base, toX) {
  const here = state.seconds[state.cursor];
  for (const placement of state.placements) {
    const [left, right] = [toX(placement.start_s), toX(placement.end_s)];
    const clicked = isClicked(placement);
    pen.beginPath();
    pen.roundRect(left, lanes.ruler + 2, Math.max(3, right - left), base - lanes.ruler - 2, 3);
    pen.fillStyle = themeColour("accent-soft");
    pen.globalAlpha = clicked ? 1 : 0.45;
    pen.fill();
    pen.globalAlpha = 1;
    if (state.looking && right - left > 14) {
      pen.font = `600 11px ${getComputedStyle(document.body).fontFamily}`;
      pen.textAlign = "center";
      pen.fillStyle = themeColour(placement.note ? "attention" : "accent");
      pen.fillText(String(state.placements.indexOf(placement) + 1), (left + right) / 2, (base + lanes.ruler) / 2);
    }
    if (!clicked) {
      pen.setLineDash([3, 3]);
      pen.strokeStyle = placement.start_s <= here && here <= placement.end_s ? themeColour("ink") : themeColour("accent");
      pen.lineWidth = 1;
      pen.stroke();
      pen.setLineDash([]);
    }
  }
}

/** @param {Ink} pen @param {number} height @param {(s: number) => number} toX @param {{from: number, to: number}} span */
function drawActivity(pen, height, toX, span) {
  const most = Math.max(1, ...activity.returns);
  const bottom = height - lanes.bottom;
  pen.fillStyle = themeColour("faint");
  pen.globalAlpha = 0.55;
  for (let slice = 0; slice < activity.returns.length; slice += 1) {
    const start = slice * activity.step_s;
    if (start + activity.step_s < span.from || start > span.to || !activity.returns[slice]) continue;
    const [left, right] = [toX(start), toX(start + activity.step_s)];
    const tall = Math.max(1, (activity.returns[slice] / most) * lanes.activity);
    pen.fillRect(left, bottom - tall, Math.max(1, right - left - 0.5), tall);
  }
  pen.globalAlpha = 1;
}

/** @param {Ink} pen @param {import("./messages.js").ClickRow} click @param {number} x @param {number} base */
function drawStem(pen, click, x, base) {
  const limit = state.view?.residual_limit_px ?? 20;
  const room = base - lanes.ruler - 8;
  const tall = click.residual_px === null ? 6 : Math.min(room, Math.max(6, (click.residual_px / (1.5 * limit)) * room));
  const colour = click.state === "pending" || click.state === "unpaired" ? ink.grey : residualColour(click.residual_px);
  const chosen = click.id !== "" && click.id === state.selected;
  pen.strokeStyle = pen.fillStyle = colour;
  pen.lineWidth = chosen ? 2.5 : 1.5;
  pen.beginPath();
  pen.moveTo(x, base);
  pen.lineTo(x, base - tall);
  pen.stroke();
  pen.beginPath();
  head(pen, click.state, x, base - tall, chosen ? 4.5 : 3.5);
  if (click.state === "excluded" || click.state === "unpaired") {
    pen.fillStyle = themeColour("surface");
    pen.fill();
    pen.lineWidth = 1.5;
    pen.stroke();
  } else pen.fill();
}

/** Inlier = disc, outlier = diamond. @param {Ink} pen @param {string} clickState @param {number} x @param {number} y @param {number} size */
function head(pen, clickState, x, y, size) {
  if (clickState !== "outlier") return pen.arc(x, y, size, 0, 2 * Math.PI);
  const reach = size * 1.35;
  pen.moveTo(x, y - reach);
  pen.lineTo(x + reach, y);
  pen.lineTo(x, y + reach);
  pen.lineTo(x - reach, y);
  pen.closePath();
}

/** @param {Ink} pen @param {number} height @param {number} x */
function drawCursor(pen, height, x) {
  pen.fillStyle = themeColour("ink");
  pen.fillRect(Math.round(x), lanes.ruler, 1, height);
  pen.beginPath();
  pen.moveTo(x - 4.5, lanes.ruler - 4);
  pen.lineTo(x + 5.5, lanes.ruler - 4);
  pen.lineTo(x + 0.5, lanes.ruler + 3);
  pen.closePath();
  pen.fill();
}
