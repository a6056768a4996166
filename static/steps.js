// @ts-check
/** What to do next: three steps while there is no calibration, one line on the frame, and the same words in the status. */

import { make } from "./notices.js";
import { clickIn, clicks, isClicked, on, placementAt, rangeApart, state } from "./state.js";

const guide = /** @type {HTMLElement} */ (document.getElementById("guide"));
/** Fewer pairs than this give no pose; the server says so too. */
const FEWEST = 4;
/** What is clicked: a corner reflector returns the wave as if from there. */
const CENTRE = "the inner corner, where its three sheets meet";

/** Words with keys between them. @typedef {(string|{key: string})[]} Words */

export function startGuide() {
  on(["opening", "shown", "view", "placements", "playing", "overlay"], drawGuide);
}

/** Three steps to the first calibration. */
export function drawSteps() {
  const count = clicks().filter((click) => click.state !== "excluded").length;
  const found = state.placements.length;
  const foundNone = "The radar shows no clear dwell: step to a frame in which the reflector stands still.";
  const goesOn = state.recording ? "The radar is searched for places where the reflector stood still…" : "Once the recording is open, the radar is searched for places where the reflector stood still.";
  const searching = state.placementsKnown ? foundNone : goesOn;
  const now = count === 0 ? 0 : count < FEWEST ? 1 : 2;
  const steps = [
    ["Go to a placement", found ? [key("N"), ` jumps to the next of ${found} that the radar has found.`] : [searching]],
    ["Click the reflector's centre", [`That is ${CENTRE}. Wheel zooms at the cursor; `, key("Alt"), "+arrows move the mark by 0.1 px."]],
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
  const words = state.shown ? (state.playing ? null : advice(state.shown.index)) : opening();
  guide.hidden = !words;
  if (!words) return;
  guide.classList.toggle("act", words.act);
  guide.replaceChildren(...words.text.map((word) => (typeof word === "string" ? word : key(word.key))));
}

/** What goes on before there is a frame. @returns {{text: Words, act: boolean}|null} */
function opening() {
  const now = state.opening;
  return now && !now.problem ? { text: [state.preview ? "A first look while the recording is opened; clicking begins as soon as that is done" : now.doing], act: false } : null;
}

/** @param {number} index @returns {{text: Words, act: boolean}|null} */
function advice(index) {
  const placement = placementAt(index);
  const here = clickIn(index);
  if (here) return afterClick(here);
  if (placement && !isClicked(placement)) {
    const number = state.placements.indexOf(placement) + 1;
    return { text: [`Placement ${number} of ${state.placements.length}, ${placement.range_m.toFixed(1)} m away: click the reflector's inner corner, where its three sheets meet`], act: true };
  }
  const next = nextDeed();
  return next ? { text: next, act: false } : null;
}

/** What is the matter with the pair of this frame; otherwise what comes next. @param {import("./messages.js").ClickRow} click @returns {{text: Words, act: boolean}|null} */
function afterClick(click) {
  const apart = rangeApart(click);
  if (apart) return { text: [`${apart}: correct the mark, or `, { key: "X" }, " leaves the pair out"], act: true };
  if (click.state === "outlier") return { text: ["This pair does not agree with the others: correct the mark, or ", { key: "X" }, " leaves it out"], act: true };
  if (click.state === "unpaired") return { text: ["The radar saw nothing here: click another frame of this placement, or go on with ", { key: "N" }], act: true };
  const next = nextDeed();
  return next ? { text: next, act: false } : null;
}

/** The next thing to do with the placements; null when there is nothing to say. @returns {Words|null} */
export function nextDeed() {
  const view = state.view;
  if (view?.stage === "unsolvable") return null; // what to do stands in the orange box
  const wrong = clicks().filter((click) => click.state === "outlier").length;
  if (view?.stage === "solved" && wrong) {
    const used = clicks().filter((click) => click.state === "inlier").length + wrong;
    return [`${used - wrong} of ${used} pairs agree: `, { key: "J" }, wrong === 1 ? " shows the one that does not" : ` shows the ${wrong} that do not, one by one`];
  }
  const left = state.placements.filter((placement) => !isClicked(placement)).length;
  if (left) return [`${left} placement${left > 1 ? "s" : ""} left: `, { key: "N" }, " goes to the next"];
  if (!state.placements.length || !view?.has_calibration || view.warnings.length) return null;
  return ["Every placement is clicked: ", { key: "E" }, " exports the calibration"];
}

/** The same for the status line: after what the server says, where that leaves it open. @returns {string} */
export function nextWords() {
  const view = state.view;
  if (!view || view.stage === "unsolvable" || view.stage === "solving") return "";
  const lost = clicks().some((click) => click.state === "unpaired");
  if (lost || (view.reference && !view.has_calibration)) return view.hint;
  const deed = view.stage === "solved" || view.clicks.length ? nextDeed() : null;
  if (!deed) return view.hint;
  const words = deed.map((word) => (typeof word === "string" ? word : word.key)).join("");
  if (view.stage !== "solved") return words;
  const told = view.status.includes("pairs agree") ? words.replace(/^\d+ of \d+ pairs agree: /, "") : words;
  return [told, view.warnings.length || words.startsWith("Every") ? view.hint : ""].filter(Boolean).join("  ·  ");
}
