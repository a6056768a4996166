/**
 * A time axis that folds gaps: where nothing was recorded, it advances by little. Seconds of the recording go in, drawn seconds come out;
 * the way is strictly monotone, so it has an exact way back, also inside a gap.
 */

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
