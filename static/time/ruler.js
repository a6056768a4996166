/**
 * The ruler of the timeline, and its time axis that folds gaps: where nothing was recorded, it advances by little. Seconds of the
 * recording go in, drawn seconds come out; the way is strictly monotone, so it has an exact way back, also inside a gap.
 */

import { smallFont, smallPx, themeColour } from "../base/colours.js";
import { isLong, minutesText } from "../base/state.js";

/** @typedef {CanvasRenderingContext2D} Context2D */
/** @typedef {import("./lanes.js").Axis} Axis */

/** Height of the ruler [CSS px]. */
export const RULER = 17;

/** Ticks and times; each stretch after a folded gap begins with its own time. @param {Context2D} pen @param {number} left @param {number} width @param {number} height @param {Axis} axis */
export function drawRuler(pen, left, width, height, axis) {
  pen.font = smallFont();
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
      const words = timeWords(seconds, step, isLong(lastOf(axis)));
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
  const places = Math.max(0, Math.ceil(-Math.log10(step)));
  if (long) return minutesText(seconds, places);
  return seconds === 0 ? "0 s" : seconds.toFixed(places);
}

/** A folded gap: hatched, with its length, upright where there is no room. @param {Context2D} pen @param {number} height @param {Axis} axis */
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

/** @param {Context2D} pen @param {string} words @param {number} left @param {number} right @param {number} height */
function drawLength(pen, words, left, right, height) {
  pen.font = smallFont();
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  const long = pen.measureText(words).width + 6;
  const lying = right - left >= long;
  if (!lying && right - left < 10) return;
  pen.translate((left + right) / 2, (height + RULER) / 2);
  if (!lying) pen.rotate(-Math.PI / 2);
  pen.fillStyle = themeColour("ground");
  pen.fillRect(-long / 2, -smallPx() / 1.5, long, smallPx() * 1.33);
  pen.fillStyle = themeColour("muted");
  pen.fillText(words, 0, 0.5);
}

/** A stretch without a gap: its times [s], and where it begins on the axis [drawn s]. @typedef {{from: number, to: number, at: number}} Stretch */
/** @typedef {{stretches: Stretch[]}} Folding */
/** A folded gap: its times [s], and where it is on the axis [drawn s]. @typedef {{from: number, to: number, start: number, end: number}} Gap */

/** Shorter gaps are never folded [s]. */
const SHORTEST_S = 5;
/** Neither are those of fewer usual intervals, since a slow recording has no gaps. */
const INTERVALS = 10;
/** What a folded gap takes of what is recorded, and what all may take together. */
const [EACH, ALL] = [0.02, 0.25];
/** A gap that would become this much shorter at least is folded. */
const WORTH = 2;

/** The axis for these moments. @param {ArrayLike<number>} times [s], ascending @returns {Folding} */
export function foldingOf(times) {
  const count = times.length;
  if (count < 2) return { stretches: [{ from: times[0] ?? 0, to: times[0] ?? 0, at: times[0] ?? 0 }] };
  const intervals = Float64Array.from({ length: count - 1 }, (_, index) => times[index + 1] - times[index]);
  const usual = intervals.slice().sort()[(count - 1) >> 1];
  const long = Math.max(SHORTEST_S, INTERVALS * usual);
  let [gaps, folded] = [0, 0];
  for (const interval of intervals) {
    if (interval <= long) continue;
    gaps += 1;
    folded += interval;
  }
  const width = (times[count - 1] - times[0] - folded) * Math.min(EACH, ALL / Math.max(1, gaps));
  const stretches = [{ from: times[0], to: times[0], at: times[0] }];
  intervals.forEach((interval, index) => {
    const last = stretches[stretches.length - 1];
    if (width > 0 && interval > long && interval > WORTH * width) {
      stretches.push({ from: times[index + 1], to: times[index + 1], at: last.at + last.to - last.from + width });
    } else last.to = times[index + 1];
  });
  return { stretches };
}

/** Where a time is on the axis. @param {Folding} folding @param {number} seconds @returns {number} drawn s */
export function toFolded({ stretches }, seconds) {
  const index = lastBefore(stretches, seconds, "from");
  const [here, next] = [stretches[index], stretches[index + 1]];
  if (seconds <= here.to || !next) return here.at + (seconds - here.from);
  const end = here.at + (here.to - here.from);
  return end + ((seconds - here.to) / (next.from - here.to)) * (next.at - end);
}

/** The time at a place of the axis. @param {Folding} folding @param {number} drawn drawn s @returns {number} s */
export function toSeconds({ stretches }, drawn) {
  const index = lastBefore(stretches, drawn, "at");
  const [here, next] = [stretches[index], stretches[index + 1]];
  const end = here.at + (here.to - here.from);
  if (drawn <= end || !next) return here.from + (drawn - here.at);
  return here.to + ((drawn - end) / (next.at - end)) * (next.from - here.to);
}

/** The gaps that are folded, in order. @param {Folding} folding @returns {Gap[]} */
export function gapsOf({ stretches }) {
  return stretches.slice(1).map((next, index) => {
    const before = stretches[index];
    return { from: before.to, to: next.from, start: before.at + (before.to - before.from), end: next.at };
  });
}

/** How long a gap is, for people. @param {number} seconds */
export function lengthWords(seconds) {
  if (seconds < 99.5) return `${Math.round(seconds)} s`;
  if (seconds < 99.5 * 60) return `${Math.round(seconds / 60)} min`;
  return seconds < 48 * 3600 ? `${Math.round(seconds / 3600)} h` : `${Math.round(seconds / 86400)} days`;
}

/** The last stretch that begins at or before a value, or the first. @param {Stretch[]} stretches @param {number} value @param {"from"|"at"} key */
function lastBefore(stretches, value, key) {
  let [low, high] = [0, stretches.length - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (stretches[middle][key] <= value) low = middle;
    else high = middle - 1;
  }
  return low;
}
