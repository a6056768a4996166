/** The top of the panel: how good the answer is; and on the page Check the metrics and the pose. All in the server's text. */

import { make, shape } from "../base/notices.js";
import { onPainted, said, state } from "../base/state.js";

/** @typedef {import("../messages.js").Figure} Figure */
const figures = /** @type {HTMLElement} */ (document.getElementById("figures"));
const posePage = /** @type {HTMLElement} */ (document.getElementById("page-pose"));
const poseTable = make("table", "", []);
const poseHead = make("div", "pose-head", "");
const apartTable = make("table", "", []);
const apart = make("div", "apart", []);
const assumedHead = make("div", "pose-head", "Not measured by this radar, assumed");
const assumedTable = make("table", "", []);
const systematicTable = make("tbody", "", []);
const systematicWords = make("div", "", []);
const systematic = make("div", "systematic", []);
const adviceLine = make("p", "advice", "");
const assumedLine = make("p", "advice", "");
const axesLine = make("p", "advice axes", "Relative to the radar's axes: x forward, y left, z up. With all angles at 0, the camera looks along x.");

export function startFigures() {
  const pose = make("div", "pose", [make("div", "", [poseTable, assumedHead, assumedTable]), axesLine, assumedLine, adviceLine]);
  const heads = [["error", ""], ["estimate", "From the pairs, ± one standard deviation"], ["before", "Assumed: Options"], ["position", "Part of the variance of the position"], ["rotation", "Part of the variance of the rotation"]];
  const head = make("tr", "", heads.map(([name, hint]) => hinted(make("th", "", name), hint)));
  systematic.append(make("div", "pose-head", "Systematic errors"), systematicWords, make("table", "", [make("thead", "", [head]), systematicTable]));
  posePage.append(poseHead, apart, pose, systematic);
  onPainted(["view", "recording", "placements"], draw);
}

function draw() {
  const view = state.view;
  if (!view) return;
  figures.classList.toggle("stale", view.solving && !view.checking && view.has_calibration);
  if (state.looking) {
    document.getElementById("page-mark")?.before(figures);
    return figures.replaceChildren(...state.placementFigures.map(cell));
  }
  figures.replaceChildren(...view.metrics.map(cell));
  poseTable.replaceChildren(...(view.pose.length ? view.pose.map(row) : [make("tr", "", [make("td", "", "Available after the first calibration.")])]));
  assumedHead.hidden = assumedTable.hidden = view.pose_assumed.length === 0;
  assumedTable.replaceChildren(...view.pose_assumed.map(row));
  drawSystematic(view.systematic_errors);
  adviceLine.textContent = view.advice?.words ?? "";
  assumedLine.textContent = said(view.verdict.assumes);
  drawReference(view);
}

/** Name the file that the pose comes from, or show how far the solved pose is from the one in it. @param {import("../messages.js").View} view */
function drawReference(view) {
  poseHead.hidden = !view.reference || view.has_calibration;
  poseHead.textContent = `From ${view.reference}, not from the clicks`;
  apart.hidden = view.comparison.length === 0;
  apart.replaceChildren(make("div", "pose-head", `Difference from ${view.reference}`), apartTable);
  apartTable.replaceChildren(...view.comparison.map(row));
}

/** The errors that do not average out: what is known of each, and its part in the uncertainty. @param {import("../messages.js").SystematicErrorTable} errors */
function drawSystematic(errors) {
  systematic.hidden = errors.rows.length === 0;
  systematicTable.replaceChildren(...errors.rows.map(systematicRow));
  systematicWords.replaceChildren(...errors.sentences.map((sentence) => make("p", "", said(sentence))));
}

/** @param {import("../messages.js").SystematicErrorRow} error */
function systematicRow({ figure, prior, position_percent, rotation_percent }) {
  const bar = (/** @type {number} */ percent) => {
    const part = make("b", "", []);
    part.style.width = `${Math.min(percent, 100)}%`;
    return make("td", "", [make("span", "part", [make("i", "", [part]), make("span", "", percent > 0 ? `${percent} %` : "–")])]);
  };
  const line = make("tr", figure.level, [
    make("td", "", figure.label),
    make("td", "", figure.value === "–" ? figure.value : [figure.value, make("span", "unit", figure.unit)]),
    make("td", "", [prior, make("span", "unit", figure.unit)]),
    bar(position_percent),
    bar(rotation_percent),
  ]);
  line.dataset.key = figure.key;
  return hinted(line, figure.hint);
}

/** @template {HTMLElement} T @param {T} element @param {string} hint @returns {T} */
function hinted(element, hint) {
  if (hint) element.dataset.hint = hint;
  return element;
}

/** @param {Figure} figure */
function cell(figure) {
  const value = make("dd", "", [figure.value, make("span", "unit", figure.unit)]);
  const name = figure.abbreviation ? [`${figure.label} `, make("span", "abbreviation", `(${figure.abbreviation})`)] : [figure.label]; // below the name
  const box = make("dl", `figure ${figure.level}`, [make("dt", "", name), value]);
  box.style.margin = "0";
  box.dataset.key = figure.key;
  box.dataset.hint = figure.hint;
  return box;
}

/** @param {Figure} figure */
function row(figure) {
  const line = make("tr", figure.level, [make("td", "", figure.label), make("td", "", figure.value), make("td", "", figure.unit)]);
  line.dataset.key = figure.key;
  line.dataset.hint = figure.hint;
  return line;
}

/** @typedef {import("../messages.js").VerdictRow} VerdictRow */
const box = /** @type {HTMLElement} */ (document.getElementById("verdict"));
/** The shape of each level, so that colour is not needed to tell them apart. @type {Record<VerdictRow["level"], string[]>} */
const SHAPES = {
  good: ["M8 1.5a6.5 6.5 0 1 0 .01 0z", "M4.8 8.2 7.2 10.6 11.4 5.6"],
  usable: ["M8 1.5a6.5 6.5 0 1 0 .01 0z", "M8 4.4v7.2M4.4 8h7.2"],
  coarse: ["M8 1.6 15 14H1z", "M8 6v4M8 11.4v1.2"],
  contradictory: ["M8 .8 15.2 8 8 15.2.8 8z", "M5.6 5.6l4.8 4.8M10.4 5.6 5.6 10.4"],
  nothing: ["M8 1.8a6.2 6.2 0 1 0 .01 0z"],
};
let drawn = "";

/** From so many pairs on, their distance says something. */
const TELLING = 4;

export function startVerdict() {
  onPainted(["view", "recording"], drawVerdict);
}

function drawVerdict() {
  const view = state.view;
  box.hidden = !view || state.looking;
  if (!view || state.looking) return;
  box.classList.toggle("stale", view.solving && view.has_calibration);
  const { level, word, early } = view.verdict;
  const [line, assumes] = [said(view.verdict.line).replace(/(\d) (?=[a-z%])/g, "$1\u00a0"), said(view.verdict.assumes)]; // a number stays with its unit
  const aed = view.metrics.find((figure) => figure.key === "aed");
  const text = JSON.stringify([level, word, line, early, assumes, aed]);
  if (text === drawn) return;
  drawn = text;
  box.dataset.level = early ? "early" : level;
  box.dataset.hint = [word + line, assumes].filter(Boolean).join("\n");
  const words = word ? [make("strong", "", word), line] : [line];
  const told = aed && view.clicks.filter((click) => click.state === "inlier").length >= TELLING ? [make("span", "aed", [make("small", "", "AED "), `${aed.value} ${aed.unit}`])] : [];
  for (const one of told) one.dataset.hint = aed?.hint;
  box.replaceChildren(sign(early ? "nothing" : level), make("p", "line", words), ...told);
}

/** @param {VerdictRow["level"]} level */
const sign = (level) => shape("svg", { viewBox: "0 0 16 16", "aria-hidden": "true" }, SHAPES[level].map((d, number) => shape("path", { d, class: number ? "sign" : "body" })));
