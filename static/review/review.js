/** The review of all pairs: their residuals as bars over a contact sheet, linked plots, and why the selected pair uses its return. */

import { register, withImages } from "../base/actions.js";
import { showPage } from "../base/layout.js";
import { make } from "../base/notices.js";
import { tell } from "../base/socket.js";
import { clicks, nameOf, on, said, select, state, timeText } from "../base/state.js";
import { comeTo } from "../image/arriving.js";
import { Plot } from "./plots.js";
import { contactSheet, drawSheet, markSheet, nextUnreviewed } from "./sheet.js";

/** @typedef {import("../messages.js").ClickRow} Click */
/** @typedef {import("../messages.js").Review} Review */
/** @typedef {import("./plots.js").Mark} Mark */
/** @typedef {import("./plots.js").Content} Content */
/** @typedef {import("./plots.js").Kind} Kind */
/** A pair that is drawn. @typedef {{click: Click, kind: Kind, right: number, down: number, length: number}} Row */

const page = /** @type {HTMLElement} */ (document.getElementById("page-review"));
const check = /** @type {HTMLElement} */ (document.getElementById("page-check"));
/** @type {[Kind, string, string][]} */
const KINDS = [
  ["agreeing", "Agreeing", "Pairs that take part in the pose: filled dots."],
  ["outlier", "Outliers", "Pairs that disagree with the others: diamonds."],
  ["excluded", "Excluded", "Pairs that you left out: hollow dots."],
  ["untouched", "Untouched", "Marks that stand where the radar expected them: hollow dots, without weight."],
];
/** @type {["length"|"right"|"down", string, string][]} */
const PARTS = [
  ["length", "Length", "Length of the residual [px]."],
  ["right", "Right", "How far right of the click the reprojection is [px]."],
  ["down", "Down", "How far below the click the reprojection is [px]."],
];
/** Plots of the residual: key, title, label of the axis, where a pair is on it, and a value of the axis in words. @type {[string, string, string, (row: Row) => number|null, ((value: number) => string)?][]} */
const AGAINST = [
  ["range", "Residual against range", "range [m]", (row) => row.click.range_m],
  ["azimuth", "Residual against azimuth", "azimuth, left positive [°]", (row) => row.click.azimuth_deg],
  ["time", "Residual against time", "time", (row) => state.seconds[row.click.frame] ?? null, (value) => timeText(value, Number.isInteger(value) ? 0 : 1)],
];

const shown = { kinds: new Set(KINDS.map(([kind]) => kind)), low: 0, high: Infinity, line: /** @type {number|null} */ (null), part: /** @type {(typeof PARTS)[number][0]} */ ("length") };
/** @type {import("./plots.js").Highlight} */
const highlight = { hovered: new Set(), brushed: new Set(), selected: null };
/** @type {Review|null} */
let review = null;
/** @type {import("../messages.js").PairReview|null} */
let pair = null;
/** What was asked for last, so that it is asked for once. */
const asked = { review: "", pair: "" };
/** @type {Map<string, Plot>} */
export const plots = new Map();
/** Whether the page was shown when it was looked at last. */
let open = false;
/** The drawing that comes with the next screen frame. */
let pending = 0;
const filters = make("div", "review-filters", []);
const grid = make("div", "review-plots", []);
const readout = make("div", "review-readout", "");
const wordsLine = make("p", "review-words", "");
const pairBox = make("section", "review-pair", []);
const why = make("details", "review-why", [make("summary", "", "Why"), wordsLine, pairBox]);
const bars = new Plot("residuals", "Residuals", { hover: hovered, go, brush, line: (value) => change(() => (shown.line = value)) });
const left = make("span", "", "");
const next = make("button", "second", "Next");

export function startReview() {
  register({ id: "check", group: "Panel", words: "Check: the pose, the review of all pairs, and two solutions compared", also: "tab transform extrinsics rotation translation errors advice plots residuals contact sheet review rms cdsd a b", run: () => showPage("check"), when: withImages });
  readout.id = "review-readout";
  readout.setAttribute("aria-live", "polite");
  const listener = { hover: hovered, go, brush };
  plots.set("residuals", bars);
  for (const [key, title] of AGAINST) {
    const plot = new Plot(key, title, listener);
    plots.set(key, plot);
    grid.append(make("figure", "", [make("figcaption", "", title), plot.canvas]));
  }
  pairBox.setAttribute("aria-label", "The selected pair");
  next.dataset.hint = "The next mark above the line that nobody has looked at (R says that you have)";
  next.onclick = () => void nextUnreviewed(above());
  const overview = make("section", "review-marks", [make("div", "to-review", [left, next]), bars.canvas, contactSheet((id) => go({ ids: [id] }))]);
  check.prepend(overview);
  page.append(filters, grid, readout, why);
  drawFilters();
  on(["view", "selected", "theme", "recording"], refresh);
  on(["box"], () => void (visible() !== open && refresh())); // a tab was shown; the box also changes while the image is moved
  on(["connection"], () => {
    asked.review = asked.pair = "";
    refresh();
  });
}

/** Whether the page is shown. */
export const visible = () => !check.hidden;

/** @param {Review} message */
export function takeReview(message) {
  review = message;
  wordsLine.textContent = said(review.words);
}

/** @param {import("../messages.js").PairReview} message */
export function takePair(message) {
  pair = message;
  drawPair();
}

function refresh() {
  open = visible();
  if (!visible() || !state.view || !state.connected) return;
  const answer = `${state.view.solved_revision} ${state.view.checking}`;
  if (asked.review !== answer) tell({ type: "review" });
  const wanted = state.selected ? `${answer} ${state.selected}` : "";
  if (wanted && asked.pair !== wanted) tell({ type: "review_pair", id: state.selected });
  Object.assign(asked, { review: answer, pair: wanted });
  draw();
}

/** Draw everything with the next screen frame: a mark that is dragged changes the view many times. */
function draw() {
  pending ||= requestAnimationFrame(drawAll);
}

function drawAll() {
  pending = 0;
  if (!visible()) return;
  highlight.selected = state.selected;
  drawMarks();
  requestAnimationFrame(drawBelow);
}

/** Draw what is below the marks, a screen frame later: nobody waits for it. */
function drawBelow() {
  drawFilters();
  drawPlots();
  drawPair();
}

/** The marks above the line. */
const above = () => new Set(rows().filter((row) => row.length >= line()).map((row) => row.click.id));

/** Residuals above it are to be reviewed [px]. */
const line = () => shown.line ?? state.view?.residual_limit_px ?? Infinity;

/** The bars and the contact sheet, the longest residual first; the line marks, and excludes nothing. */
function drawMarks() {
  const worst = rows().sort((a, b) => b.length - a.length);
  const marked = above();
  const reviewed = state.view?.reviewed ?? [];
  const open = worst.filter(({ click, kind }) => marked.has(click.id) && kind !== "excluded" && !reviewed.includes(click.id)).length;
  left.textContent = worst.length ? `${marked.size} of ${worst.length} above ${Number.isFinite(line()) ? digits(line()) : "–"} px, ${open} to review` : "No marks to review yet";
  next.disabled = !open;
  const marks = worst.map((row, index) => ({ ids: [row.click.id], x: index + 0.5, y: row.length, kind: /** @type {Kind} */ (marked.has(row.click.id) ? "outlier" : row.kind), text: () => told(row) }));
  const high = 1.08 * Math.max(1, ...marks.map((mark) => mark.y));
  bars.show({ marks, x: { label: "marks; drag the line", low: 0, high: Math.max(1, worst.length) }, y: { label: "residual [px]", low: 0, high }, bar: 1, limit: Number.isFinite(line()) ? Math.min(line(), high) : null, empty: EMPTY }, highlight);
  drawSheet(worst, marked, highlight);
}

/** All pairs with a reprojection, in order of time. @returns {Row[]} */
function rows() {
  const drawn = clicks().filter((click) => click.projected_px && click.state !== "pending" && click.state !== "unpaired");
  return drawn.sort((a, b) => a.frame - b.frame).map((click) => {
    const [u, v] = /** @type {[number, number]} */ (click.projected_px);
    return { click, kind: kindOf(click), right: u - click.u_px, down: v - click.v_px, length: click.residual_px ?? 0 };
  });
}

/** @param {Click} click @returns {Kind} */
function kindOf(click) {
  if (click.mark === "untouched") return "untouched";
  return click.state === "inlier" ? "agreeing" : click.state === "outlier" ? "outlier" : "excluded";
}

/** @param {Row} row */
const passes = (row) => shown.kinds.has(row.kind) && (row.click.range_m ?? 0) >= shown.low && (row.click.range_m ?? 0) <= shown.high;

/** Chips that say what is shown, made again when the counts change. */
function drawFilters() {
  const all = rows();
  const held = /** @type {HTMLElement|null} */ (document.activeElement)?.dataset.filter;
  if (document.activeElement instanceof HTMLInputElement && filters.contains(document.activeElement)) return;
  const kinds = KINDS.filter(([kind]) => kind === "agreeing" || all.some((row) => row.kind === kind)).map(([kind, label, hint]) => {
    const count = all.filter((row) => row.kind === kind).length;
    return chip(kind, `${label} ${count}`, hint, shown.kinds.has(kind), () => void (shown.kinds.delete(kind) || shown.kinds.add(kind)));
  });
  const parts = PARTS.map(([part, label, hint]) => {
    const button = make("button", "", label);
    button.setAttribute("aria-pressed", String(shown.part === part));
    button.dataset.filter = part;
    button.dataset.hint = hint;
    button.onclick = () => change(() => (shown.part = part));
    return button;
  });
  const segments = make("div", "segmented", parts);
  segments.setAttribute("role", "group");
  segments.setAttribute("aria-label", "Part of the residual");
  filters.replaceChildren(...kinds, make("span", "review-range", ["range", limit("low", "from"), "–", limit("high", "to"), "m"]), segments);
  if (held) /** @type {HTMLElement|null} */ (filters.querySelector(`[data-filter="${held}"]`))?.focus({ preventScroll: true });
}

/** @param {string} key @param {string} label @param {string} hint @param {boolean} pressed @param {() => void} toggle */
function chip(key, label, hint, pressed, toggle) {
  const button = make("button", "chip", label);
  button.dataset.filter = key;
  button.dataset.hint = hint;
  button.setAttribute("aria-pressed", String(pressed));
  button.onclick = () => change(toggle);
  return button;
}

/** @param {"low"|"high"} end @param {string} label */
function limit(end, label) {
  const field = make("input", "", []);
  field.type = "number";
  field.min = "0";
  field.step = "1";
  field.dataset.filter = end;
  field.setAttribute("aria-label", `Range ${label} [m]`);
  field.placeholder = end === "low" ? "0" : "∞";
  field.value = Number.isFinite(shown[end]) && shown[end] > 0 ? String(shown[end]) : "";
  field.oninput = () => {
    shown[end] = field.value === "" ? (end === "low" ? 0 : Infinity) : Number(field.value);
    drawPlots();
  };
  return field;
}

/** @param {() => unknown} what */
function change(what) {
  what();
  draw();
}

function drawPlots() {
  const drawn = rows().filter(passes);
  for (const [key, , label, at, words] of AGAINST) plots.get(key)?.show(scatter(drawn, label, at, words), highlight);
}

const EMPTY = "no clicks to show";

/** @param {Row[]} drawn @param {string} label @param {(row: Row) => number|null} at @param {(value: number) => string} [words] @returns {Content} */
function scatter(drawn, label, at, words) {
  const marks = drawn.filter((row) => at(row) !== null).map((row) => ({ ids: [row.click.id], x: Number(at(row)), y: row[shown.part], kind: row.kind, text: () => told(row) }));
  const limitPx = state.view?.residual_limit_px ?? null;
  const usual = drawn.filter((row) => row.kind === "agreeing").map((row) => Math.abs(row[shown.part]));
  const most = 1.12 * Math.max(1e-3, ...(usual.length ? usual : drawn.map((row) => Math.abs(row[shown.part]))));
  const y = { label: `${shown.part === "length" ? "residual" : `residual ${shown.part}`} [px]`, low: shown.part === "length" ? 0 : -most, high: most };
  return { marks, x: { label, words, ...spread(marks.map((mark) => mark.x)) }, y, bar: 0, limit: shown.part === "length" ? limitPx : null, empty: EMPTY };
}

/** @param {Mark|null} mark */
function hovered(mark) {
  const ids = mark?.ids ?? [];
  if (ids.length === highlight.hovered.size && ids.every((id) => highlight.hovered.has(id))) return;
  highlight.hovered = new Set(ids);
  readout.textContent = mark?.text() ?? brushedText();
  redraw();
}

const brushedText = () => (highlight.brushed.size ? `${count(highlight.brushed.size)} marked. Click beside the marks, or Esc, to end.` : "");

/** @param {string[]} ids */
function brush(ids) {
  highlight.brushed = new Set(ids);
  readout.textContent = brushedText();
  redraw();
}

/** Go to a pair; of several, to the one with the longest residual, and mark the others. @param {{ids: string[]}} mark */
function go(mark) {
  const met = clicks().filter((click) => mark.ids.includes(click.id)).sort((a, b) => (b.residual_px ?? 0) - (a.residual_px ?? 0));
  if (!met.length) return;
  if (met.length > 1) brush(mark.ids);
  select(met[0].id);
  comeTo(met[0].frame);
}

function redraw() {
  for (const plot of plots.values()) plot.draw();
  markSheet(highlight);
}

/** Which return the selected pair uses, and why. */
function drawPair() {
  pairBox.hidden = !state.selected;
  if (!state.selected) return;
  if (pair?.id !== state.selected) return pairBox.replaceChildren(make("h2", "", state.selected));
  pairBox.replaceChildren(...pairParts(pair));
}

/** @param {import("../messages.js").PairReview} pair @returns {HTMLElement[]} */
function pairParts(pair) {
  const facts = pair.facts.map((fact) => {
    const box = make("div", "", [make("dt", "", fact.label), make("dd", "", fact.unit ? `${fact.value} ${fact.unit}` : fact.value)]);
    box.dataset.hint = fact.hint;
    return box;
  });
  return [make("h2", "", `Pair ${nameOf(pair.id)}`), make("p", "", said(pair.why)), make("dl", "", facts)];
}

/** Limits of an axis, a little beyond its values. @param {number[]} values */
function spread(values) {
  if (!values.length) return { low: 0, high: 1 };
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const margin = 0.05 * (high - low) || 0.5;
  return { low: low - margin, high: high + margin };
}

/** A pair in one line. @param {Row} row */
function told(row) {
  const { click } = row;
  const side = (/** @type {number|null} */ angle, /** @type {string} */ plus, /** @type {string} */ minus) => `${Math.abs(angle ?? 0).toFixed(1)}° ${(angle ?? 0) >= 0 ? plus : minus}`;
  const [, influence = null, heldOut = null] = review?.rows.find(([id]) => id === click.id) ?? [];
  const more = [heldOut === null ? "" : `leave-one-out ${digits(heldOut)} px`, influence === null ? "" : `influence ${digits(influence)} σ`];
  return [`${nameOf(click.id)}: ${digits(row.length)} px`, `${click.range_m?.toFixed(1)} m, ${side(click.azimuth_deg, "left", "right")}`, ...more.filter(Boolean)].join(" · ");
}

/** Three significant digits. @param {number} value */
const digits = (value) => (Math.abs(value) < 0.995 ? String(Number(value.toFixed(2))) : String(Number(value.toPrecision(3))));

/** @param {number} number */
const count = (number) => `${number} click${number === 1 ? "" : "s"}`;
