/** The page in words, for those who do not see it: the picture with its marks, and where the dividers are. */

import { on, clicksIn, isClicked, placementAt, state } from "./state.js";

const words = /** @type {HTMLElement} */ (document.getElementById("picture-words"));
/** The picture is described once nothing has changed for this long [ms], so that a screen reader can finish. */
const REST_MS = 500;
/** @type {Record<string, string>} */
const STATES = { inlier: "agrees with the others", outlier: "does not agree with the others", excluded: "excluded", unpaired: "no radar return belongs to it", pending: "not in the calibration yet" };
let timer = 0;

export function startDescribing() {
  on(["shown", "view", "overlay", "look", "selected", "placements", "playing", "cursor"], () => {
    clearTimeout(timer);
    if (!state.playing) timer = window.setTimeout(draw, REST_MS);
  });
  on(["box"], measureDividers);
  addEventListener("resize", measureDividers);
  for (const bar of dividers()) for (const type of ["keyup", "pointerup", "focus"]) bar.addEventListener(type, measureDividers);
  measureDividers();
}

function draw() {
  const text = state.looking ? lookWords() : pictureWords();
  if (words.textContent !== text) words.textContent = text;
}

/** The frame, its placement and its marks, in sentences. */
function pictureWords() {
  const index = state.shown?.index;
  if (index === undefined) return "";
  const returns = state.overlay?.index === index ? (state.overlay.returns?.length ?? 0) : 0;
  const others = (state.view?.clicks ?? []).filter((click) => click.frame !== index).length;
  return [moment(index), placementWords(index), ...markWords(index), plural(others, "mark in other frames", "marks in other frames"), plural(returns, "radar return in the picture", "radar returns in the picture")].filter(Boolean).join(". ") + ".";
}

/** The same for a recording without pictures. */
function lookWords() {
  const returns = state.look?.index === state.cursor ? state.look : null;
  return returns ? `${[moment(state.cursor), placementWords(state.cursor)].filter(Boolean).join(". ")}.` : "";
}

/** @param {number} index */
const moment = (index) => `Frame ${index + 1} of ${state.seconds.length}, ${(state.seconds[index] ?? 0).toFixed(1)} s`;

/** @param {number} index */
function placementWords(index) {
  const placement = placementAt(index);
  if (!placement) return state.placementsKnown ? "Between placements" : "";
  const marked = state.looking || isClicked(placement) ? "" : ", not clicked yet";
  return `Placement ${state.placements.indexOf(placement) + 1} of ${state.placements.length}, ${placement.range_m.toFixed(1)} m away${marked}`;
}

/** @param {number} index @returns {string[]} */
function markWords(index) {
  const here = clicksIn(index);
  if (here.length) return here.flatMap((click) => [oneMark(click), click.note]);
  const guess = state.overlay?.index === index ? state.overlay.guesses[0] : undefined;
  return [guess ? `No mark in this frame; the reflector is expected at column ${guess[0].toFixed(0)}, row ${guess[1].toFixed(0)}` : "No mark in this frame"];
}

/** @param {import("./messages.js").ClickRow} click */
function oneMark(click) {
  const residual = click.residual_px === null ? "" : `, ${click.residual_px.toFixed(1)} px from where the radar expects it`;
  const guessed = click.mark === "untouched" ? "a guess that does not count" : (STATES[click.state] ?? click.state);
  const selected = click.id !== "" && click.id === state.selected ? ", selected" : "";
  return `Mark ${click.id} at column ${click.u_px.toFixed(1)}, row ${click.v_px.toFixed(1)}${selected}: ${guessed}${residual}`;
}

/** @param {number} count @param {string} one @param {string} many */
const plural = (count, one, many) => (count ? `${count} ${count === 1 ? one : many}` : "");

const dividers = () => /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll(".divider"));

/** Where each divider is, as the share of the space before it [%]. */
function measureDividers() {
  for (const bar of dividers()) {
    const [box, around] = [bar.getBoundingClientRect(), bar.parentElement?.getBoundingClientRect()];
    if (!around) continue;
    const upright = bar.getAttribute("aria-orientation") === "vertical";
    const share = upright ? (box.left - around.left) / around.width : (box.top - around.top) / around.height;
    const values = { valuemin: 0, valuemax: 100, valuenow: Math.round(100 * Math.min(1, Math.max(0, share || 0))) };
    for (const [name, value] of Object.entries(values)) bar.setAttribute(`aria-${name}`, String(value));
  }
}
