/** How far the calibration of the lens is: what was found, which view is missing, where the board was. */

import { drawCoverage } from "./lens_plots.js";
import { make } from "./notices.js";
import { state } from "./state.js";

export const lensProgress = make("section", "lens-progress", []);
const bar = make("progress", "", []);
const cancel = make("button", "second", "Cancel");
const barRow = make("div", "lens-bar", [bar, cancel]);
const words = make("p", "lens-words", "");
const missing = make("ul", "lens-missing", []);
const map = make("canvas", "lens-map", []);
const coverageRow = make("div", "lens-coverage", []);

/** @param {() => void} stop called by the button that cancels */
export function startLensProgress(stop) {
  lensProgress.setAttribute("aria-label", "Progress");
  bar.setAttribute("aria-label", "Pictures searched");
  map.setAttribute("role", "img");
  cancel.onclick = stop;
  lensProgress.append(barRow, words, missing, coverageRow);
}

/** Whether a calibration runs. */
export const running = () => state.lens?.stage === "searching" || state.lens?.stage === "calibrating";

/** Put the focus on the button that cancels. */
export const focusCancel = () => cancel.focus();

/** Show the present state; the elements stay, so that a button keeps its focus. @param {import("./messages.js").LensState} lens */
export function drawProgress(lens) {
  lensProgress.hidden = lens.stage === "idle" || (lens.stage === "done" && !lens.coverage);
  barRow.hidden = !running();
  if (lens.stage === "searching") [bar.max, bar.value] = [lens.total || 1, lens.searched];
  else bar.removeAttribute("value");
  words.className = `lens-words ${lens.stage}`;
  words.replaceChildren(...[progressWords(lens)].flat());
  missing.replaceChildren(...(lens.coverage?.missing ?? []).map((sentence) => make("li", "", sentence)));
  missing.hidden = !missing.childElementCount;
  coverageRow.hidden = !lens.coverage;
  if (lens.coverage) coverageRow.replaceChildren(map, tallies(lens.coverage));
}

/** Draw where the board was. @param {number} wide of a picture @param {number} high */
export function drawMap(wide, high) {
  const coverage = state.lens?.coverage;
  if (!coverage || !map.isConnected) return;
  drawCoverage(map, coverage, wide, high);
  map.setAttribute("aria-label", `Where the board was in the picture: ${Math.round(100 * coverage.share)} % is covered`);
}

/** @param {import("./messages.js").LensState} lens @returns {string|(HTMLElement|string)[]} */
function progressWords(lens) {
  const found = `the board was found in ${lens.views} of ${lens.searched} pictures`;
  const sentence = found[0].toUpperCase() + found.slice(1);
  const left = lens.left_out ? `, ${lens.left_out} left out` : "";
  if (lens.stage === "searching") return lens.total ? `Searching at least ${lens.total} pictures: ${found}${left}.` : "Looking for the board…";
  if (lens.stage === "calibrating") return `${sentence}${left}. ${lens.doing || "Calibrating the lens"}…`;
  if (lens.stage === "cancelled") return `Cancelled: ${found}. They are kept: Resume goes on from them.`;
  if (lens.stage === "failed") return [make("strong", "", lens.problem), lens.hint ? ` ${lens.hint}` : ""];
  return `${sentence}; the result says which of them it uses.`;
}

/** @param {import("./messages.js").LensCoverage} coverage */
function tallies(coverage) {
  const row = (/** @type {string} */ name, /** @type {import("./messages.js").LensTally[]} */ counts) =>
    make("div", "", [make("dt", "", name), make("dd", "", counts.map((one) => make("span", one.count ? "" : "none", `${one.name} ${one.count}`)))]);
  const share = make("div", "", [make("dt", "", "Covered"), make("dd", "", [make("span", "", `${Math.round(100 * coverage.share)} % of the picture`)])]);
  return make("dl", "lens-tallies", [share, row("Turned", coverage.tilts), row("Distance", coverage.distances)]);
}
