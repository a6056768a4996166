/** The verdict at the top of the panel: how far to trust the calibration, in one line, and what to do. It never scrolls away. */

import { make } from "./notices.js";
import { proposalAdvice } from "./proposal_words.js";
import { on, state } from "./state.js";

/** @typedef {import("./messages.js").VerdictRow} VerdictRow */
const box = /** @type {HTMLElement} */ (document.getElementById("verdict"));
/** The shape of each level, so that colour is not needed to tell them apart. @type {Record<VerdictRow["level"], string[]>} */
const SHAPES = {
  good: ["M8 1.5a6.5 6.5 0 1 0 .01 0z", "M4.8 8.2 7.2 10.6 11.4 5.6"],
  usable: ["M8 1.5a6.5 6.5 0 1 0 .01 0z", "M8 4.4v7.2M4.4 8h7.2"],
  weak: ["M8 1.6 15 14H1z", "M8 6v4M8 11.4v1.2"],
  contradictory: ["M8 .8 15.2 8 8 15.2.8 8z", "M5.6 5.6l4.8 4.8M10.4 5.6 5.6 10.4"],
  nothing: ["M8 1.8a6.2 6.2 0 1 0 .01 0z"],
};
let drawn = "";

export function startVerdict() {
  on(["view", "recording", "proposals"], draw);
}

function draw() {
  const view = state.view;
  box.hidden = !view || state.looking;
  if (!view || state.looking) return;
  box.classList.toggle("stale", view.solving && view.has_calibration);
  const { level, line, action, key, done } = view.verdict;
  const proposed = key === "N" ? proposalAdvice() : "";
  const text = JSON.stringify(view.verdict) + proposed;
  if (text === drawn) return;
  drawn = text;
  box.dataset.level = level;
  box.dataset.hint = [line, proposed ? `N${proposed}` : action].filter(Boolean).join("\n");
  const rest = line.startsWith(level) ? line.slice(level.length) : ` ${line}`;
  const next = make("p", done ? "next done" : "next", proposed ? [make("span", "key", key), make("span", "", proposed)] : [make("span", "", action)]);
  if (key && !proposed) next.append(make("span", "key", key));
  box.replaceChildren(shape(level), make("div", "words", [make("p", "line", [make("strong", "", level), rest]), next]));
}

/** @param {VerdictRow["level"]} level */
function shape(level) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 16 16");
  svg.setAttribute("aria-hidden", "true");
  for (const [number, outline] of SHAPES[level].entries()) {
    const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
    path.setAttribute("d", outline);
    path.setAttribute("class", number ? "sign" : "body");
    svg.append(path);
  }
  return svg;
}
