/** Colours of amplitudes, the same as in the 3D view (app/cocalib/web/view3d/looking.py): from most returns to the strongest of the recording. */

import { state } from "./state.js";

const DARK = [[78, 66, 190], [150, 60, 180], [214, 82, 120], [246, 150, 70], [250, 226, 92]];
const LIGHT = [[240, 190, 110], [226, 120, 86], [180, 56, 120], [112, 36, 140], [44, 12, 92]];

const isLight = () => document.documentElement.dataset.theme === "light";

/** Colour of what was there, whatever its amplitude. */
export const staying = () => (isLight() ? "rgb(96 110 126)" : "rgb(128 146 164)");

/** The amplitudes at both ends of the colours; null if the radar has none. @returns {[number, number]|null} */
export function amplitudeRange() {
  const { low_db: low, high_db: high } = state.radarMap ?? { low_db: null, high_db: null };
  return low === null || high === null ? null : [low, high];
}

/** @param {number} amplitude dB */
export function amplitudeColour(amplitude) {
  const range = amplitudeRange();
  if (!range) return staying();
  return rampColour((amplitude - range[0]) / Math.max(range[1] - range[0], 1e-9));
}

/** @param {number} share 0 to 1 */
export function rampColour(share) {
  const ramp = isLight() ? LIGHT : DARK;
  const at = Math.min(1, Math.max(0, share)) * (ramp.length - 1);
  const low = Math.min(ramp.length - 2, Math.floor(at));
  return `rgb(${ramp[low].map((value, index) => Math.round(value + (at - low) * (ramp[low + 1][index] - value))).join(" ")})`;
}
