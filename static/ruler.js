/** The ruler of the timeline, and its folded gaps. */

import { themeColour } from "./colours.js";
import { gapsOf, lengthWords } from "./folding.js";

/** @typedef {CanvasRenderingContext2D} Ink */
/** @typedef {import("./lanes.js").Axis} Axis */

/** Height of the ruler [CSS px]. */
export const RULER = 17;
/** Size of the text in the timeline [CSS px]. */
export const text = { px: 10.5 };

/** Ticks and times; each stretch after a folded gap begins with its own time. @param {Ink} pen @param {number} left @param {number} width @param {number} height @param {Axis} axis */
export function drawRuler(pen, left, width, height, axis) {
  pen.font = `${text.px}px ${themeColour("mono")}`;
  pen.textBaseline = "middle";
  pen.textAlign = "center";
  const stretches = axis.folding.stretches.filter(({ from, to }) => to >= axis.from_s && from <= axis.to_s);
  const scale = pixelsPerSecond(axis);
  const rough = 90 / scale;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= rough) ?? 10 * power;
  let free = left - 8;
  stretches.forEach(({ from, to }, index) => {
    const starts = axis.folding.stretches.length > 1 ? [from] : [];
    const end = index === stretches.length - 1 ? axis.to_s : to;
    const begin = Math.max(starts.length ? from : -Infinity, axis.from_s, 0);
    const ticks = [];
    for (let tick = Math.ceil(begin / step); tick * step <= end; tick += 1) ticks.push(tick * step);
    for (const seconds of [...starts, ...ticks]) {
      const x = axis.toX(seconds);
      const words = timeWords(seconds, step, lastOf(axis) >= 600);
      const half = pen.measureText(words).width / 2;
      pen.fillStyle = themeColour("line");
      pen.fillRect(Math.round(x), RULER - 3, 1, height - RULER + 3);
      if (x - half < free || x + half > width) continue;
      pen.fillStyle = themeColour("faint");
      pen.fillText(words, x, 6.5);
      free = x + half + 12;
    }
  });
}

/** CSS px per second outside gaps. @param {Axis} axis */
export function pixelsPerSecond({ toX, folding: { stretches } }) {
  const { from, to } = stretches[stretches.length - 1];
  const length = Math.max(to - from, 1);
  return (toX(from + length) - toX(from)) / length;
}

/** The last time with data [s]. @param {Axis} axis */
const lastOf = ({ folding: { stretches } }) => stretches[stretches.length - 1].to;

/** @param {number} seconds @param {number} step [s] @param {boolean} long whether the recording has many minutes */
function timeWords(seconds, step, long) {
  if (long && step >= 1) {
    const [hours, minutes, rest] = [Math.floor(seconds / 3600), Math.floor(seconds / 60) % 60, Math.floor(seconds % 60)];
    const two = (/** @type {number} */ value) => String(value).padStart(2, "0");
    return hours ? `${hours}:${two(minutes)}:${two(rest)}` : `${minutes}:${two(rest)}`;
  }
  if (seconds === 0) return "0 s";
  return step < 1 ? seconds.toFixed(Math.ceil(-Math.log10(step))) : String(Math.round(seconds));
}

/** A folded gap: hatched, with its length, upright where there is no room. @param {Ink} pen @param {number} height @param {Axis} axis */
export function drawGaps(pen, height, axis) {
  for (const { from, to } of gapsOf(axis.folding)) {
    if (to < axis.from_s || from > axis.to_s) continue;
    const [left, right] = [axis.toX(from) + 1, axis.toX(to) - 1];
    if (right - left < 1) continue;
    pen.save();
    pen.beginPath();
    pen.rect(left, RULER, right - left, height - RULER);
    pen.clip();
    pen.fillStyle = themeColour("ground");
    pen.fillRect(left, RULER, right - left, height);
    pen.strokeStyle = themeColour("line-strong");
    pen.lineWidth = 1;
    pen.beginPath();
    for (let x = left - height; x < right; x += 7) {
      pen.moveTo(x, height);
      pen.lineTo(x + height - RULER, RULER);
    }
    pen.stroke();
    drawLength(pen, lengthWords(to - from), left, right, height);
    pen.restore();
  }
}

/** @param {Ink} pen @param {string} words @param {number} left @param {number} right @param {number} height */
function drawLength(pen, words, left, right, height) {
  pen.font = `${text.px}px ${getComputedStyle(document.body).fontFamily}`;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  const long = pen.measureText(words).width + 6;
  const lying = right - left >= long;
  if (!lying && right - left < 10) return;
  pen.translate((left + right) / 2, (height + RULER) / 2);
  if (!lying) pen.rotate(-Math.PI / 2);
  pen.fillStyle = themeColour("ground");
  pen.fillRect(-long / 2, -text.px / 1.5, long, text.px * 1.33);
  pen.fillStyle = themeColour("muted");
  pen.fillText(words, 0, 0.5);
}
