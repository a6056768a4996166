/** Colours of the marks. The residual ramp from blue through sand to red-orange also works for colour-blind users; shapes carry the same information. */

/** Shares from 0 to 1, each with its colour. @typedef {readonly (readonly [number, readonly number[]])[]} Ramp */

/** @type {Ramp} */
const RESIDUALS = [
  [0, [74, 170, 235]],
  [0.35, [143, 200, 226]],
  [0.6, [236, 214, 150]],
  [0.8, [240, 158, 66]],
  [1, [226, 82, 44]],
];

/** Amplitudes, the same as in the 3D view, by the theme. @type {Record<string, Ramp>} */
const AMPLITUDES = {
  dark: [[0, [78, 66, 190]], [0.25, [150, 60, 180]], [0.5, [214, 82, 120]], [0.75, [246, 150, 70]], [1, [250, 226, 92]]],
  light: [[0, [240, 190, 110]], [0.25, [226, 120, 86]], [0.5, [180, 56, 120]], [0.75, [112, 36, 140]], [1, [44, 12, 92]]],
};

export const ink = {
  click: "#ffffff",
  ring: "#ffb454",
  line: "#ffb454",
  edge: "rgb(0 0 0 / 70%)",
  still: "#6cc7ff",
  moving: "#ff9d5c",
  guess: "#b9e3ff",
  grey: "#9aa6b2",
};

/** Residuals from here on have the last colour of the ramp [px]. The scale is fixed, so that a colour means the same after every click. */
export const LARGE_PX = 30;

/** Colour of a residual. @param {number|null} residual px @returns {string} */
export function residualColour(residual) {
  if (residual === null || !Number.isFinite(residual)) return ink.grey;
  return rampColour(residual / LARGE_PX);
}

/** Colour of an amplitude. @param {number} share of those of most returns, 0 to 1 */
export const amplitudeColour = (share) => rampColour(share, AMPLITUDES[document.documentElement.dataset.theme === "light" ? "light" : "dark"]);

/** @param {number} share of the ramp, 0 to 1 @param {Ramp} [ramp] */
export function rampColour(share, ramp = RESIDUALS) {
  const at = Math.min(1, Math.max(0, share));
  const upper = ramp.findIndex(([stop]) => stop >= at);
  if (upper <= 0) return `rgb(${ramp[0][1].join(" ")})`;
  const [[low, from], [high, to]] = [ramp[upper - 1], ramp[upper]];
  const part = (at - low) / (high - low);
  return `rgb(${from.map((value, index) => Math.round(value + part * (to[index] - value))).join(" ")})`;
}

/** A colour of the theme. @param {string} name */
export const themeColour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

/** The small text of canvases, which grows on a 4K monitor as that of the page does [CSS px]. */
export const smallPx = () => (innerWidth >= 2800 ? 16 : 12);

/** How much larger marks are on a 4K monitor. */
export const growth = () => smallPx() / 12;

/** Its font, for a canvas with so many pixels per CSS px. @param {number} [ratio] @param {"600"|""} [weight] */
export const smallFont = (ratio = 1, weight = "") => `${weight} ${smallPx() * ratio}px ${themeColour("face")}`;
