/** What to do next: three steps while there is no calibration, one line on the frame, and the same text in the status line. */

import { boxing } from "../boxes/boxes.js";
import { boxAdvice } from "../boxes/evaluating.js";
import { saidWords } from "../proposals/proposals.js";
import { proposalAdvice, proposalWords, silentWords } from "../proposals/words.js";
import { act, actionNamed } from "../shell/actions.js";
import { make } from "../shell/notices.js";
import { clickIn, clicks, clicksIn, isClicked, isDismissed, isOffered, on, placementAt, placementsAt, rangeApart, state } from "../shell/state.js";

const guide = /** @type {HTMLElement} */ (document.getElementById("guide"));
/** Minimum number of pairs for a pose; the server enforces it too. */
const FEWEST = 4;
/** The point to click: a corner reflector's echo seems to come from there. */
const CENTRE = "the inner corner, where its three sheets meet";

/** Text with keys in between; a key with an action is a button. @typedef {(string|{key: string, action?: string})[]} Words */

export function startGuide() {
  on(["opening", "shown", "view", "placements", "playing", "overlay", "candidates", "cross", "selected", "boxes", "layers", "proposals", "connection"], drawGuide);
}

/** Three steps to the first calibration. */
export function drawSteps() {
  const count = placesMarked();
  const found = state.placements.length;
  const foundNone = "No placement was found in the radar data. Go to a frame in which the reflector stands still.";
  const goesOn = state.recording ? "Searching the radar data for places where the reflector stood still…" : "Once the recording is open, the radar data is searched for places where the reflector stood still.";
  const soFar = "No placement so far. Put the reflector down and step away for five seconds.";
  const live = state.following?.state === "live" || state.following?.state === "quiet";
  const searching = live ? soFar : state.placementsKnown ? foundNone : goesOn;
  const now = count === 0 ? 0 : count < FEWEST ? 1 : 2;
  const steps = [
    ["Go to a placement", found ? [key("N"), proposalAdvice() || ` jumps to the next of ${found} found in the radar data.`] : [searching]],
    ["Click the reflector's centre", [`That is ${CENTRE}. Zoom with the wheel; `, key("Alt"), "+arrows move the mark by 0.1 px."]],
    [`Repeat for at least ${FEWEST} placements`, [count ? `${count} done. ` : "", "Spread them: near and far, left and right. The pose appears automatically and improves with each one."]],
  ];
  const items = steps.map(([title, text], index) =>
    make("li", index < now ? "done" : index === now ? "now" : "", [
      make("span", "", [make("strong", "", /** @type {string} */ (title)), ...text]),
    ]),
  );
  return make("ol", "steps", items);
}

/** How many places have a mark that counts; marks outside any placement count only where the radar data has none. */
function placesMarked() {
  const counting = clicks().filter((click) => click.state !== "excluded" && click.state !== "untouched" && click.state !== "unpaired");
  const here = state.placements.filter((placement) => !isDismissed(placement));
  if (!here.length) return counting.length;
  return here.filter((placement) => counting.some((click) => placementsAt(click.frame).includes(placement)) && isClicked(placement)).length;
}

/** @param {string} name */
const key = (name) => make("span", "key", name);

/** A key that can be clicked; the focus stays where it is. @param {string} name @param {string} action */
function keyButton(name, action) {
  const button = make("button", "key", name);
  button.setAttribute("aria-label", actionNamed(action).words);
  button.onmousedown = (event) => event.preventDefault();
  button.onclick = () => act(actionNamed(action));
  return button;
}

function drawGuide() {
  if (state.looking) return; // picture/birdseye.js says what is there
  const words = state.shown ? (state.playing ? null : advice(state.shown.index)) : opening();
  guide.hidden = !words;
  if (!words) return;
  guide.classList.toggle("act", words.act);
  guide.classList.toggle("long", words.long === true);
  if (guide.textContent === words.text.map((word) => (typeof word === "string" ? word : word.key)).join("")) return; // said once
  guide.replaceChildren(...words.text.map((word) => (typeof word === "string" ? word : word.action ? keyButton(word.key, word.action) : key(word.key))));
}

/** What to show before there is a frame. @returns {{text: Words, act: boolean, long?: boolean}|null} */
function opening() {
  const now = state.opening;
  return now && !now.problem ? { text: [state.preview ? "Preview: you can click once the recording is open" : now.doing], act: false } : null;
}

/** @param {number} index @returns {{text: Words, act: boolean, long?: boolean}|null} `long` takes two lines */
function advice(index) {
  if (state.rectified) return { text: ["Rectified: straight edges must be straight. Drag a line along one to compare. ", { key: "U" }, ": as taken"], act: false };
  if (boxing.on) return boxAdvice();
  const placement = placementAt(index);
  const here = clickIn(index);
  if (state.cross) return atCross(state.cross);
  const offer = proposalWords();
  if (offer) return { text: offer, act: true, long: true };
  const said = saidWords();
  if (said && !(placement && isOffered(placement))) return { text: [said.trim()], act: false, long: true };
  if (here) return afterClick(here);
  if (placement && isDismissed(placement)) return { text: ["This placement is dismissed. ", { key: "X" }, " offers it again"], act: false };
  if (placement && isOffered(placement)) {
    const number = state.placements.indexOf(placement) + 1;
    const several = placementsAt(index).length > 1 ? ` (one of ${placementsAt(index).length} at this time)` : "";
    const why = said.trim() || silentWords(number - 1);
    const silent = why ? `. ${why}` : "";
    return { text: [`Placement ${number} of ${state.placements.length}, ${placement.range_m.toFixed(1)} m away${several}: click the reflector's inner corner, where its three sheets meet. No reflector here: `, { key: "X" }, silent], act: true, long: silent !== "" };
  }
  const next = nextAction();
  return next ? { text: next, act: false } : null;
}

/** @param {import("../picture/cross.js").Cross} cross @returns {{text: Words, act: boolean}} */
function atCross(cross) {
  const begin = cross.touched || !cross.expected ? "" : "The radar expects the reflector here. ";
  const last = cross.touched ? " sets the mark" : cross.expected ? " without moving the cross leaves a guess that does not count" : " sets the mark once the cross is there";
  return { text: [begin, { key: "1" }, "–", { key: "9" }, " zoom in, ", { key: "arrows" }, " move, ", { key: "Enter" }, last], act: true };
}

/** What is wrong with the pair of this frame, or else what to do next. @param {import("../messages.js").ClickRow} click @returns {{text: Words, act: boolean}|null} */
function afterClick(click) {
  const better = state.candidates?.click === click.id ? state.candidates.suggestion : "";
  if (better) return { text: [better.replace(/: C takes it$/, ": "), { key: "C" }, " takes it"], act: true };
  if (click.state === "untouched") return { text: ["A guess: nobody has looked, so it does not count. Move it to the inner corner, or press ", { key: "Del" }], act: true };
  if (clicksIn(click.frame).length > placementsAt(click.frame).length && placementsAt(click.frame).length)
    return { text: [`${clicksIn(click.frame).length} marks in this frame, and ${placementsAt(click.frame).length === 1 ? "one placement" : `${placementsAt(click.frame).length} placements`}. A mark that is not a reflector: `, { key: "Del" }], act: true };
  if (state.placements.length && !placementsAt(click.frame).length) return { text: ["The radar saw no reflector put down at this time. If it was being carried, press ", { key: "Del" }], act: true };
  const apart = rangeApart(click);
  if (apart) return { text: [`${apart}. Correct the mark, or press `, { key: "X" }, " to exclude the pair"], act: true };
  const blamed = click.note.startsWith("Disagrees"); // otherwise the method or an option sets the pair aside: the note says which
  if (click.state === "outlier" && !blamed) return { text: [click.note], act: true };
  if (click.state === "outlier") return { text: outlierWords(click), act: true };
  if (click.state === "unpaired") return { text: ["No radar position here. Click another frame of this placement, or press ", { key: "N" }, " for the next one"], act: true };
  const next = nextAction();
  return next ? { text: next, act: false } : null;
}

/** What may be wrong with a pair that disagrees: the mark, or the return. @param {import("../messages.js").ClickRow} click @returns {Words} */
function outlierWords(click) {
  const others = state.candidates?.click === click.id && state.candidates.rows.length > 1;
  if (others) return ["This pair does not agree with the others. Is the mark on the inner corner? ", { key: "C" }, " tries another return, ", { key: "X" }, " excludes it"];
  return ["This pair does not agree with the others. Is the mark on the inner corner? If so, ", { key: "X" }, " excludes it"];
}

/** The next thing to do: the verdict's action, with its key; null when there is nothing to say. @returns {Words|null} */
function nextAction() {
  const view = state.view;
  if (!view || view.stage === "unsolvable") return null; // the orange box says what to do
  const { action, key, done } = view.verdict;
  const guesses = clicks().filter((click) => click.state === "untouched").length;
  if (guesses && !state.placements.some(isOffered)) return [`${guesses} ${guesses > 1 ? "marks are guesses that do" : "mark is a guess that does"} not count: move each to the reflector`];
  if (done) return ["Done. Press ", { key: "E" }, " to export the calibration"];
  if (key === "N" && proposalAdvice()) return [{ key }, proposalAdvice()];
  return key ? [`${action} Press `, { key }] : null; // others are longer than a line: the verdict shows them
}

/** The same for the status line, after the server's status, and how to find the pairs that disagree. @returns {string} */
export function nextWords() {
  const view = state.view;
  if (!view || view.stage === "unsolvable" || view.stage === "solving") return "";
  const wrong = view.method === "paper" ? 0 : clicks().filter((click) => click.state === "outlier").length;
  const outliers = view.stage === "solved" && wrong ? `Press J to see the ${wrong === 1 ? "outlier" : `${wrong} outliers one by one`}` : "";
  const action = view.hint === view.verdict.action && !view.verdict.done ? nextAction() : null;
  const words = action ? action.map((word) => (typeof word === "string" ? word : word.key)).join("") : view.hint;
  return [outliers, words].filter(Boolean).join("  ·  ");
}
