// @ts-check
/** What to do next: three steps while there is no calibration, and one line on the frame that points at the reflector. */

import { make } from "./notices.js";
import { clickIn, clicks, isClicked, on, placementAt, state } from "./state.js";

const guide = /** @type {HTMLElement} */ (document.getElementById("guide"));
/** Fewer pairs than this give no pose; the server says so too. */
const FEWEST = 4;

export function startGuide() {
  on(["shown", "view", "placements", "playing"], drawGuide);
}

/** Three steps to the first calibration. */
export function drawSteps() {
  const count = clicks().filter((click) => click.state !== "excluded").length;
  const found = state.placements.length;
  const searching = state.placementsKnown ? "The radar shows no clear dwell: step to a frame in which the reflector stands still." : "The radar is searched for places where the reflector stood still…";
  const now = count === 0 ? 0 : count < FEWEST ? 1 : 2;
  const steps = [
    ["Go to a placement", [key("N"), found ? ` jumps to the next of ${found} that the radar has found.` : ` ${searching}`]],
    ["Click the reflector's centre", ["Wheel zooms at the cursor; ", key("Alt"), "+arrows move the mark by 0.1 px."]],
    [`Do so for ${FEWEST} placements or more`, [count ? `${count} done. ` : "", "Near and far, left and right: the pose appears by itself and gets surer with each."]],
  ];
  const items = steps.map(([title, text], index) =>
    make("li", index < now ? "done" : index === now ? "now" : "", [
      make("span", "", [make("strong", "", /** @type {string} */ (title)), ...text]),
    ]),
  );
  return make("ol", "steps", items);
}

/** @param {string} name */
const key = (name) => make("span", "key", name);

function drawGuide() {
  const words = state.shown && !state.playing ? advice(state.shown.index) : null;
  guide.hidden = !words;
  if (!words) return;
  guide.classList.toggle("act", words.act);
  guide.replaceChildren(...words.text);
}

/** @param {number} index @returns {{text: (string|Node)[], act: boolean}|null} */
function advice(index) {
  const placement = placementAt(index);
  if (clickIn(index)) return null;
  if (placement && !isClicked(placement)) {
    const number = state.placements.indexOf(placement) + 1;
    return { text: [`Placement ${number} of ${state.placements.length}, ${placement.range_m.toFixed(1)} m away: click the reflector's centre`], act: true };
  }
  if (state.placements.some((other) => !isClicked(other)) && clicks().length < FEWEST) {
    return { text: ["Press ", key("N"), " for the next placement of the reflector"], act: false };
  }
  return null;
}
