/** What is under the pointer in the 3D view, in words; and where range numbers stand so that they can be read. */

/** @typedef {import("./messages.js").SpaceLook} Look */
/** @typedef {import("./messages.js").SpaceReturn} Return */
/**
 * Something that can be picked, at its place in the view [CSS px].
 * @typedef {{kind: "return"|"window"|"placement"|"reflector"|"candidate", index: number, x: number, y: number, words: string, key: string}} Item
 */

/** So far from the pointer, things can be picked [CSS px]. */
const REACH = 12;
/** Things that lead somewhere win over returns at the same place [CSS px]. */
const PREFERRED = { candidate: 5, placement: 3, reflector: 4, return: 0, window: 0 };
/** Range numbers stand along a line at one of these azimuths [deg], the first that suits. */
const AZIMUTHS = [-28, 28, -12, 12, -45, 45, 0, -60, 60, -68, 68];

/** The item nearest to a point. @param {Iterable<Item>} items @param {number} x @param {number} y CSS px @returns {Item|null} */
export function nearest(items, x, y) {
  let [best, least] = [/** @type {Item|null} */ (null), Infinity];
  for (const item of items) {
    const apart = Math.hypot(item.x - x, item.y - y);
    if (apart > REACH || apart - PREFERRED[item.kind] >= least) continue;
    [best, least] = [item, apart - PREFERRED[item.kind]];
  }
  return best;
}

/**
 * A return in words: "20.0 m, 2.5° right, 0.4° down, SNR 23 dB, 0.0 m/s, still".
 * @param {Return} seen
 */
export function describeReturn([, , , range, azimuth, elevation, doppler, snr, isStill, age]) {
  const words = [`${range.toFixed(1)} m`, sideways(azimuth), upwards(elevation)];
  if (snr !== null) words.push(`SNR ${snr.toFixed(0)} dB`);
  if (doppler !== null) words.push(`${fixed(doppler, 1)} m/s`, isStill ? "still" : "moving");
  if (age > 0.05) words.push(`${age.toFixed(1)} s ago`);
  return words.join(", ");
}

/** @param {number} angle deg, positive to the left */
const sideways = (angle) => `${Math.abs(angle).toFixed(1)}° ${angle > 0 ? "left" : "right"}`;
/** @param {number} angle deg, positive upwards */
const upwards = (angle) => `${Math.abs(angle).toFixed(1)}° ${angle < 0 ? "down" : "up"}`;
/** A number without "-0.0". @param {number} value @param {number} decimals */
const fixed = (value, decimals) => value.toFixed(decimals).replace(/^-(0\.?0*)$/, "$1");

/** A position in words. @param {readonly number[]} position m */
export function describePlace([x, y, z]) {
  const level = Math.hypot(x, y);
  return `${Math.hypot(level, z).toFixed(1)} m, ${sideways((Math.atan2(y, x) * 180) / Math.PI)}, ${upwards((Math.atan2(z, level) * 180) / Math.PI)}`;
}

/** Boxes of words that do not overlap: the first come stay. */
export class Board {
  /** @param {number} width @param {number} height CSS px */
  constructor(width, height) {
    [this.width, this.height] = [width, height];
    /** @type {[number, number, number, number][]} */
    this.taken = [];
  }

  /** Whether a box around a point is free and inside. @param {number} x @param {number} y @param {number} wide @param {number} high */
  isFree(x, y, wide, high) {
    const [left, top, right, bottom] = [x - wide / 2, y - high / 2, x + wide / 2, y + high / 2];
    if (left < 2 || top < 2 || right > this.width - 2 || bottom > this.height - 2) return false;
    return !this.taken.some(([l, t, r, b]) => left < r && right > l && top < b && bottom > t);
  }

  /** Take a box if it is free. @param {number} x @param {number} y @param {number} wide @param {number} high */
  take(x, y, wide, high) {
    if (!this.isFree(x, y, wide, high)) return false;
    this.taken.push([x - wide / 2, y - high / 2, x + wide / 2, y + high / 2]);
    return true;
  }
}

/**
 * Where the numbers of the range rings stand: along one azimuth if most can be read there, each of the others where it is free.
 * @param {readonly number[]} ranges m @param {number} ground m
 * @param {(point: readonly number[]) => [number, number]|null} project
 * @param {Board} board @param {(range: number) => [number, number]} sizeOf CSS px
 * @returns {{range: number, x: number, y: number}[]}
 */
export function ringPlaces(ranges, ground, project, board, sizeOf) {
  const at = (/** @type {number} */ range, /** @type {number} */ azimuth) => {
    const angle = (azimuth * Math.PI) / 180;
    return project([range * Math.cos(angle), range * Math.sin(angle), ground]);
  };
  const readable = (/** @type {number} */ azimuth) => {
    const trial = new Board(board.width, board.height);
    trial.taken = [...board.taken];
    return ranges.filter((range) => { const place = at(range, azimuth); return place && trial.take(...place, ...sizeOf(range)); }).length;
  };
  const counts = AZIMUTHS.map(readable);
  const first = AZIMUTHS[counts.indexOf(Math.max(...counts))];
  const placed = [];
  for (const range of ranges)
    for (const azimuth of [first, ...AZIMUTHS]) {
      const place = at(range, azimuth);
      if (!place || !board.take(...place, ...sizeOf(range))) continue;
      placed.push({ range, x: place[0], y: place[1] });
      break;
    }
  return placed;
}
