/** The line on the frame: the one thing to do now, with its keys, which are buttons; by finger only their words are shown. */

import { act, actionNamed } from "../base/actions.js";
import { make } from "../base/notices.js";
import { called, clickIn, clicks, isDismissed, isOffered, nameOf, on, placementAt, placementsAt, said, state } from "../base/state.js";
import { openOption } from "../options/options.js";
import { comeTo } from "../image/arriving.js";
import { saidWords } from "../proposals/proposals.js";
import { placementWords, proposalAdvice, proposalWords, silentWords } from "../proposals/words.js";
import { goToPair } from "./pairs.js";

const guide = /** @type {HTMLElement} */ (document.getElementById("guide"));

/** @typedef {import("../proposals/words.js").Key} Key */
/** @typedef {import("../proposals/words.js").Words} Words */
/** What the line says; `act` if something is to be done in this frame. @typedef {{text: Words, act: boolean}} Advice */

export function startGuide() {
  on(["opening", "shown", "view", "placements", "playing", "overlay", "candidates", "cross", "selected", "layers", "proposals", "connection"], drawGuide);
}

/** The focus stays where it is. @param {Key} key */
function keyPart({ key, label, action, pair, frame, option }) {
  const parts = [...(key ? [make("kbd", "key", key)] : []), label];
  if (!action && !pair && !option && frame === undefined) return make("span", "", parts);
  const button = make("button", "do", parts);
  button.onmousedown = (event) => event.preventDefault();
  button.onclick = () => (pair ? goToPair(pair) : frame !== undefined ? comeTo(frame) : option ? openOption(option) : act(actionNamed(action ?? "")));
  return button;
}

function drawGuide() {
  if (state.looking) return; // image/birdseye.js says what is there
  const words = state.shown ? (state.playing ? null : advice(state.shown.index)) : opening();
  guide.hidden = !words;
  if (!words) return;
  guide.classList.toggle("act", words.act);
  if (guide.dataset.said === JSON.stringify(words.text)) return; // said once
  guide.dataset.said = JSON.stringify(words.text);
  guide.replaceChildren(...words.text.map((word) => (typeof word === "string" ? make("span", "", word) : keyPart(word))));
}

/** What to show before there is a frame. @returns {Advice|null} */
function opening() {
  const now = state.opening;
  return now && !now.problem && state.preview ? { text: ["Preview: you can click once the recording is open"], act: false } : null;
}

const EXCLUDE = { key: "X", label: "exclude it", action: "exclude" };
const REMOVE = { key: "Del", label: "delete it", action: "delete" };
const SHOW = { key: "J", label: "show it", action: "worst" };
const POSITION = { key: "", label: "enter the camera position", option: "solving.camera_position" };
const LENS = { key: "", label: "open Lens", action: "lens" };
const RANGE = { key: "", label: "change it", option: "gating.max_range_m" };
/** @type {Words} */
const BEYOND = ["No radar return within the maximum range.", RANGE];
const NEXT = { key: "N", label: "next placement", action: "next-placement" };

/** @param {number} index @returns {Advice|null} */
function advice(index) {
  if (state.rectified) return { text: ["Straight edges must be straight: drag a line along one.", { key: "U", label: "image as taken", action: "rectify" }], act: false };
  const placement = placementAt(index);
  const here = clickIn(index);
  if (state.cross) return atCross(state.cross);
  const offer = proposalWords();
  if (offer) return { text: offer, act: true };
  const found = saidWords();
  if (found && !(placement && isOffered(placement))) return { text: [found], act: false };
  if (here) return afterClick(here);
  if (placement && isDismissed(placement)) return { text: ["Dismissed.", { key: "X", label: "offer it again", action: "exclude" }, NEXT], act: false };
  if (placement && isOffered(placement)) {
    const number = state.placements.indexOf(placement) + 1;
    const several = placementsAt(index).length > 1 ? `, one of ${placementsAt(index).length} now` : "";
    const why = found || silentWords(number - 1);
    return { text: [`${placementWords(number - 1)}${several}: click the inner corner.${why ? ` ${why}` : ""}`, { key: "X", label: "no reflector", action: "exclude" }, NEXT], act: true };
  }
  const next = nextAction();
  return next ? { text: next, act: false } : null;
}

/** @param {import("../base/state.js").Cross} cross @returns {Advice} */
function atCross(cross) {
  const begin = cross.touched || !cross.expected ? [] : ["The radar expects it here."];
  const last = cross.touched ? "set the mark" : cross.expected ? "leave a guess, which does not count" : "set the mark, once moved";
  return { text: [...begin, { key: "1–9", label: "zoom" }, { key: "arrows", label: "move" }, { key: "Enter", label: last, action: "place-mark" }], act: true };
}

/** What is wrong with the pair of this frame, or else what to do next. @param {import("../messages.js").ClickRow} click @returns {Advice|null} */
function afterClick(click) {
  const better = state.candidates?.click === click.id ? state.candidates.suggestion : "";
  if (better) return { text: [better, { key: "C", label: "take the other", action: "next-candidate" }], act: true };
  if (click.state === "untouched") return { text: ["A guess, which does not count: move it to the inner corner.", REMOVE], act: true };
  if (click.state === "unpaired") return { text: state.view?.verdict.option === RANGE.option ? BEYOND : ["No radar position here: click another frame of this placement.", NEXT], act: true };
  if (click.state === "outlier") return { text: outlierWords(click), act: true };
  const next = nextAction();
  return next ? { text: next, act: false } : null;
}

/** What may be wrong with a pair that disagrees: the mark, or the return. @param {import("../messages.js").ClickRow} click @returns {Words} */
function outlierWords(click) {
  if (!click.disagrees) return [click.note]; // the method or an option sets the pair aside: the note says which
  const carried = state.placements.length > 0 && !placementsAt(click.frame).length ? " Was the reflector being carried?" : "";
  const others = state.candidates?.click === click.id && state.candidates.rows.length > 1;
  return [`#${nameOf(click.id)} disagrees with the other pairs. Is the mark on the inner corner?${carried}`, ...(others ? [{ key: "C", label: "another return", action: "next-candidate" }] : []), EXCLUDE];
}

/** The next thing to do: the verdict's action, with its key; null when there is nothing to say. @returns {Words|null} */
function nextAction() {
  const view = state.view;
  if (!view) return null;
  const { key, kind, option, done, pairs } = view.verdict;
  const action = said(view.verdict.action);
  const guesses = clicks().filter((click) => click.state === "untouched").length;
  if (guesses && !state.placements.some(isOffered)) return [`${guesses} ${guesses > 1 ? "marks are guesses" : "mark is a guess"} and ${guesses > 1 ? "do" : "does"} not count: move ${guesses > 1 ? "each" : "it"} to the inner corner`];
  const by = option === POSITION.option ? [POSITION] : kind === "CalibrateLens" ? [LENS] : option && option !== RANGE.option ? [{ key: "", label: "open this option", option }] : [];
  const leftOut = clicks().filter((click) => click.state === "outlier").map(({ id }) => `#${nameOf(id)}`);
  if (done) return ["Done.", { key: "E", label: "export", action: "export" }, ...(leftOut.length ? [`Left out: ${leftOut.join(", ")}`, SHOW] : by.length ? ["Better:", ...by] : [])];
  if (option === RANGE.option) return BEYOND;
  if (key === "N" && view.clicks.length && !state.placements.some(isOffered)) return null; // the last one is on its way
  if (key === "N") return [{ key, label: proposalAdvice(), action: "next-placement" }];
  const goOn = state.placements.some(isOffered) ? [NEXT] : [];
  const met = pairs.find((id) => view.clicks.some((click) => click.id === id));
  if (met !== undefined && key !== "J") return [action, { key: "", label: `show ${called(met)}`, pair: met }, ...goOn];
  if (key === "J") return [action, SHOW];
  const edge = kind === "SpreadPlacements" ? state.placements.filter(isOffered).sort((a, b) => Math.abs(b.azimuth_deg) - Math.abs(a.azimuth_deg))[0] : undefined;
  if (view.clicks.length) return [action, ...by, ...(edge ? [{ key: "", label: `show placement ${state.placements.indexOf(edge) + 1}`, frame: edge.frame }] : goOn)];
  if (!state.placementsKnown) return ["Looking for placements. You can click meanwhile."];
  return state.placements.length ? [action] : [`${state.placementSummary}. ${action}`];
}
