/**
 * The line on the frame: the one thing to do now, with its keys, which are buttons; by finger only their words are shown. It is
 * the first of `RULES` that holds.
 */

import { act, actionNamed } from "../base/actions.js";
import { make } from "../base/notices.js";
import { called, clickIn, clicks, isDismissed, isOffered, on, placementAt, placementsAt, said, state, stateOf } from "../base/state.js";
import { openOption } from "../options/options.js";
import { comeTo } from "../image/arriving.js";
import { question } from "../image/candidates.js";
import { saidWords } from "../proposals/proposals.js";
import { placementWords, proposalAdvice, proposalWords, silentWords } from "../proposals/words.js";
import { goToPair } from "./pairs.js";

const guide = /** @type {HTMLElement} */ (document.getElementById("guide"));

/** @typedef {import("../proposals/words.js").Key} Key */
/** @typedef {import("../proposals/words.js").Words} Words */
/**
 * What the rules ask.
 * @typedef {object} Now
 * @property {import("../messages.js").ClickRow|undefined} click Of this frame.
 * @property {import("../base/state.js").Placement|undefined} placement Of this frame.
 * @property {import("../base/state.js").Placement[]} open Those that want a click.
 * @property {import("../messages.js").VerdictRow} verdict
 */
/** @typedef {{name: string, when: (now: Now) => unknown, say: (now: Now) => Words, act?: boolean}} Rule `act`: something is to be done in this frame */

export function startGuide() {
  on(["opening", "shown", "view", "placements", "playing", "overlay", "candidates", "cross", "selected", "layers", "proposals", "connection"], drawGuide);
  guide.onclick = ({ target }) => target === guide.firstChild && guide.classList.toggle("whole"); // in a narrow window, a long text is folded
}

/** The focus stays where it is. @param {Key} key @param {boolean} only whether the line offers nothing else to do */
function keyPart({ key, label, action, pair, frame, option }, only) {
  const parts = [...(key ? [make("kbd", "key", key)] : []), label];
  if (!action && !pair && !option && frame === undefined) return make("span", "", parts);
  const button = make("button", action === "place-mark" || action === "export" || (only && action === "next-placement") ? "do primary" : "do", parts);
  button.onmousedown = (event) => event.preventDefault();
  button.onclick = () => (pair ? goToPair(pair) : frame !== undefined ? comeTo(frame) : option ? openOption(option) : act(actionNamed(action ?? "")));
  return button;
}

function drawGuide() {
  if (state.looking) return; // image/birdseye.js says what is there
  const now = state.shown && state.view && !state.playing ? seen(state.shown.index, state.view) : null;
  const rule = now && RULES.find(({ when }) => when(now));
  const words = rule ? rule.say(now) : state.shown ? [] : opening();
  guide.hidden = !words.length;
  if (!words.length) return;
  guide.classList.toggle("act", Boolean(rule?.act));
  guide.dataset.rule = rule?.name ?? "opening";
  if (guide.dataset.said === JSON.stringify(words)) return; // said once
  guide.dataset.said = JSON.stringify(words);
  guide.classList.remove("whole");
  const only = words.filter((word) => typeof word !== "string").length === 1;
  guide.replaceChildren(...words.map((word) => (typeof word === "string" ? make("span", "", word) : keyPart(word, only))));
}

/** What to show before there is a frame. @returns {Words} */
function opening() {
  const now = state.opening;
  return now && !now.problem && state.preview ? ["Preview: you can click once the recording is open"] : [];
}

/** @param {number} index @param {import("../messages.js").View} view @returns {Now} */
const seen = (index, { verdict }) => ({ click: clickIn(index), placement: placementAt(index), open: state.placements.filter(isOffered), verdict });

const EXCLUDE = { key: "X", label: "exclude it", action: "exclude" };
const REMOVE = { key: "Del", label: "delete it", action: "delete" };
const SHOW = { key: "J", label: "show", action: "worst" };
const POSITION = { key: "", label: "enter the camera position", option: "solving.camera_position" };
const LENS = { key: "", label: "open Lens", action: "lens" };
const ASSUMED = { key: "", label: "open Recording", action: "recording" };
const RANGE = { key: "", label: "change it", option: "gating.max_range_m" };
const TOGETHER = { key: "", label: "open recordings together", action: "recording" };
const JUDGE = { key: "", label: "judge a calibration", action: "evaluate" };
/** @type {Words} */
const BEYOND = ["No radar return within the maximum range.", RANGE];
const NEXT = { key: "N", label: "next placement", action: "next-placement" };

/** @type {Rule[]} */
const RULES = [
  { name: "rectified", when: () => state.rectified, say: () => ["Straight edges must be straight: drag a line along one.", { key: "U", label: "image as taken", action: "rectify" }] },
  { name: "cross", when: () => state.cross, say: crossWords, act: true },
  { name: "proposal", when: proposalWords, say: () => proposalWords() ?? [], act: true },
  { name: "told", when: ({ placement }) => saidWords() && !(placement && isOffered(placement)), say: () => [saidWords()] },
  { name: "return", when: question, say: returnWords, act: true },
  { name: "guess", when: ({ click }) => click?.state === "untouched", say: () => ["A guess, which does not count: move it to the inner corner.", REMOVE], act: true },
  { name: "beyond", when: ({ click, verdict }) => click?.state === "unpaired" && verdict.option === RANGE.option, say: () => BEYOND, act: true },
  { name: "unpaired", when: ({ click }) => click?.state === "unpaired", say: () => ["No radar position here: click another frame of this placement.", NEXT], act: true },
  { name: "set-aside", when: ({ click }) => click?.state === "outlier" && !click.disagrees, say: ({ click }) => [click?.note ?? ""], act: true }, // the method or an option does it
  { name: "slip", when: ({ click }) => click && slips().includes(click.id), say: slipWords, act: true },
  { name: "misfit", when: ({ click }) => click?.state === "outlier", say: misfitWords, act: true },
  { name: "dismissed", when: ({ click, placement }) => !click && placement && isDismissed(placement), say: () => ["Dismissed.", { key: "X", label: "offer it again", action: "exclude" }, NEXT] },
  { name: "placement", when: ({ click, placement }) => !click && placement && isOffered(placement), say: placementHere, act: true },
  { name: "guesses", when: ({ open }) => !open.length && guesses(), say: () => guessWords() },
  { name: "done", when: ({ verdict }) => verdict.done, say: doneWords },
  { name: "out-of-range", when: ({ verdict }) => verdict.option === RANGE.option, say: () => BEYOND },
  { name: "misfits", when: ({ verdict }) => misfits(verdict), say: ({ verdict, open }) => [misfits(verdict), SHOW, ...onward(open)] },
  { name: "slips", when: () => slips().length, say: ({ open }) => [`${called(slips()[0])} does not fit the images`, { key: "", label: "show", pair: slips()[0] }, ...onward(open)] },
  { name: "coming", when: ({ verdict, open }) => verdict.key === "N" && clicks().length && !open.length, say: () => [] }, // the last one is on its way
  { name: "one-more", when: ({ verdict }) => verdict.key === "N" && verdict.kind === "FollowHint", say: ({ verdict }) => [said(verdict.action), NEXT] },
  { name: "next", when: ({ verdict }) => verdict.key === "N", say: () => [{ ...NEXT, label: proposalAdvice() }] },
  { name: "pair", when: ({ verdict }) => pairOf(verdict).length, say: ({ verdict, open }) => [said(verdict.action), ...pairOf(verdict), ...onward(open)] },
  { name: "edge", when: ({ verdict, open }) => verdict.kind === "SpreadPlacements" && open.length, say: edgeWords },
  { name: "verdict", when: () => clicks().length, say: ({ verdict, open }) => [said(verdict.action), ...does(verdict), ...onward(open)] },
  { name: "searching", when: () => !state.placementsKnown, say: () => ["Looking for placements. You can click meanwhile."] },
  { name: "first", when: () => state.placements.length, say: ({ verdict }) => [said(verdict.action)] },
  { name: "none", when: () => true, say: () => [`${state.placementSummary}.`, TOGETHER, JUDGE] },
];

/** @param {import("../base/state.js").Placement[]} open @returns {Words} */
const onward = (open) => (open.length ? [NEXT] : []);

/** @returns {Words} */
function crossWords() {
  const { touched, expected } = /** @type {import("../base/state.js").Cross} */ (state.cross);
  const last = touched ? "set the mark" : expected ? "leave a guess, which does not count" : "set the mark, once moved";
  return [...(touched || !expected ? [] : ["The radar expects it here."]), { key: "1–9", label: "zoom" }, { key: "arrows", label: "move" }, { key: "Enter", label: last, action: "place-mark" }];
}

/** @returns {Words} */
function returnWords() {
  const { rows, shown } = question() ?? { rows: [], shown: 0 };
  const answers = state.candidates?.rows ?? [];
  const words = state.candidates?.asked.length ? `Which return? ${rows.map((row) => answers[row].answer).join(" | ")}` : `Return ${rows.indexOf(shown) + 1} of ${rows.length}: ${answers[shown].answer}`;
  return [words, { key: "C", label: "show another", action: "next-candidate" }, { key: "Enter", label: `keep ${answers[shown].range_m.toFixed(1)} m`, action: "place-mark" }];
}

/** What may be wrong with a pair that disagrees: the mark, or the return. @param {Now} now @returns {Words} */
function misfitWords({ click }) {
  const { id, frame } = /** @type {import("../messages.js").ClickRow} */ (click);
  const carried = state.placements.length > 0 && !placementsAt(frame).length ? " Was the reflector being carried?" : "";
  const others = state.candidates?.click === id && state.candidates.rows.length > 1;
  return [`${called(id)} does not fit the other pairs. Is the mark on the inner corner?${carried}`, ...(others ? [{ key: "C", label: "another return", action: "next-candidate" }] : []), EXCLUDE];
}

/** The clicks beside which the images show the reflector. */
const slips = () => (state.proposals?.slips ?? []).filter((id) => clicks().some((click) => click.id === id && !["untouched", "excluded"].includes(click.state)));

/** @param {Now} now @returns {Words} */
function slipWords({ click }) {
  const { id } = /** @type {import("../messages.js").ClickRow} */ (click);
  return [`${called(id)} does not fit the images: the reflector is probably beside it. Is the mark on the inner corner?`, EXCLUDE];
}

/** @returns {Words} */
function placementHere() {
  const here = placementsAt(state.shown?.index ?? 0);
  const number = state.placements.indexOf(here.find(isOffered) ?? here[0]);
  const why = saidWords() || silentWords(number);
  return [`${placementWords(number)}${here.length > 1 ? `, one of ${here.length} now` : ""}: click the inner corner.${why ? ` ${why}` : ""}`, { key: "X", label: "no reflector", action: "exclude" }, NEXT];
}

const guesses = () => clicks().filter((click) => click.state === "untouched").length;

/** @returns {Words} */
const guessWords = () => [guesses() > 1 ? `${guesses()} marks are guesses and do not count: move each to the inner corner` : "1 mark is a guess and does not count: move it to the inner corner"];

/** What explains misfits better than a mark. */
const OF_ALL = ["CalibrateLens", "SetOption"];

/** The pairs that are set aside; "" without any, or if the answer itself is in question. @param {import("../messages.js").VerdictRow} verdict */
const misfits = (verdict) => (verdict.level === "contradictory" || OF_ALL.includes(verdict.kind) ? "" : said(verdict.misfits));

/** @param {Now} now @returns {Words} */
function doneWords({ verdict }) {
  const by = does(verdict);
  const still = state.placements.filter((one) => stateOf(one) === "unlikely").length;
  const rest = still ? [{ key: "", label: `${still} more still object${still > 1 ? "s" : ""}`, action: "still-objects" }] : [];
  return ["Done.", { key: "E", label: "export", action: "export" }, ...(misfits(verdict) ? [misfits(verdict), SHOW] : by.length ? ["Better:", ...by] : []), ...rest];
}

/** What begins the verdict's action: a field or a panel. @param {import("../messages.js").VerdictRow} verdict @returns {Words} */
const does = ({ option, kind }) => (option === POSITION.option ? [POSITION] : kind === "CalibrateLens" ? [LENS] : kind === "ConfirmAssumptions" ? [ASSUMED] : option && option !== RANGE.option ? [{ key: "", label: "open this option", option }] : []);

/** The pair that the verdict's action is about. @param {import("../messages.js").VerdictRow} verdict @returns {Key[]} */
const pairOf = ({ pairs }) => pairs.filter((id) => clicks().some((click) => click.id === id)).slice(0, 1).map((pair) => ({ key: "", label: `show ${called(pair)}`, pair }));

/** @param {Now} now @returns {Words} */
function edgeWords({ verdict, open }) {
  const edge = open.reduce((one, other) => (Math.abs(other.azimuth_deg) > Math.abs(one.azimuth_deg) ? other : one));
  return [said(verdict.action), ...does(verdict), { key: "", label: `show placement ${state.placements.indexOf(edge) + 1}`, frame: edge.frame }];
}
