/** How the user wants the 3D view: colours, trail, hidden, enlarged. Remembered in this browser. */

import { state } from "../base/state.js";

/** @typedef {import("../messages.js").CursorMoved["colour"]} Colour */
const KEPT = "cocalib-space";

/** @type {{colour: Colour|null, trail_s: number, whole: boolean, hidden: boolean, large: boolean, camera: boolean}} */
export const spaceOptions = { colour: null, trail_s: 0, whole: false, hidden: false, large: false, camera: false, ...kept() };

function kept() {
  try {
    const { colour = null, trail_s = 0, hidden = false, large = false } = JSON.parse(localStorage.getItem(KEPT) ?? "{}");
    return { colour, trail_s: Number(trail_s) || 0, hidden: Boolean(hidden), large: Boolean(large) && !hidden };
  } catch {
    return {};
  }
}

/** Change something and remember it. @param {Partial<typeof spaceOptions>} change */
export function changeSpace(change) {
  Object.assign(spaceOptions, change);
  try {
    const { colour, trail_s, hidden, large } = spaceOptions;
    localStorage.setItem(KEPT, JSON.stringify({ colour, trail_s, hidden, large }));
  } catch {
    // Without storage, it is just not remembered.
  }
}

/** What the colours mean: what was chosen here, else without images the same as seen from above. @returns {NonNullable<Colour>} */
export const spaceColour = () => spaceOptions.colour ?? (state.looking ? state.lookOptions.colour : "speed");

/** What the server is told with every cursor. */
export function cursorOptions() {
  const { trail_s, whole } = state.looking ? state.lookOptions : spaceOptions;
  return { trail_s, whole, colour: spaceColour(), hidden: spaceOptions.hidden };
}
