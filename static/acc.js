/** What the boxes say about the calibration: Acc, each class, and how Acc changes when the camera is turned, which says what it can see at all. */

import { themeColour } from "./colours.js";
import { make } from "./notices.js";
import { on, state } from "./state.js";

/** @typedef {import("./messages.js").AccPanel} Panel */
/** @typedef {import("./messages.js").SensitivityRow} Row */

const box = make("section", "acc", []);
const WIDE = 92;
const HIGH = 26;
let drawn = "";

/** The section of the tab. */
export function accSection() {
  box.setAttribute("aria-label", "What the boxes say");
  on(["theme"], () => {
    drawn = "";
    drawAcc();
  });
  return box;
}

export function drawAcc() {
  const panel = state.view?.acc;
  box.hidden = !panel || !(panel.figures.length || panel.problem || panel.judging);
  if (!panel || box.hidden) return;
  const text = JSON.stringify(panel);
  if (text === drawn) return;
  drawn = text;
  box.classList.toggle("stale", panel.judging);
  box.setAttribute("aria-busy", String(panel.judging));
  box.replaceChildren(...(panel.figures.length ? parts(panel) : [make("p", "acc-problem", panel.problem || "Comparing boxes and radar…")]), ...panel.warnings.map(warning));
}

/** @param {Panel} panel */
function parts(panel) {
  const figures = make("dl", "acc-figures", panel.figures.map(({ label, value, unit, hint, level, key }) => {
    const one = make("div", `figure ${level}`, [make("dt", "", label), make("dd", "", [value, make("span", "unit", unit)])]);
    one.dataset.hint = hint;
    one.dataset.acc = key;
    one.tabIndex = 0;
    return one;
  }));
  const classes = make("table", "acc-classes", [
    make("thead", "", [make("tr", "", ["Class", "Acc", "Frames", "Returns inside"].map((name) => make("th", "", name)))]),
    make("tbody", "", panel.classes.map((row) => make("tr", "", [row.label, row.acc, String(row.frames), `${row.inside} of ${row.returns}`].map((cell) => make("td", "", cell))))),
  ]);
  const angles = make("table", "acc-angles", [
    make("caption", "", "Acc of the camera turned about one axis: where it is flat, or highest elsewhere, it cannot judge that angle"),
    make("thead", "", [make("tr", "", ["Axis", "−1°", "0°", "+1°", ""].map((name) => make("th", "", name)))]),
    make("tbody", "", panel.sensitivity.map(angleRow)),
  ]);
  const rule = make("details", "acc-rule", [make("summary", "", "Which returns count"), make("p", "", panel.rule)]);
  return [make("p", "acc-caution", panel.caution), figures, angles, classes, rule];
}

/** @param {Row} row */
function angleRow(row) {
  const cell = make("td", "", [curve(row)]);
  const line = make("tr", row.is_flat ? "flat" : "", [make("td", "", row.axis), ...row.values.map((value) => make("td", "", value)), cell]);
  line.dataset.hint = row.words;
  line.tabIndex = 0;
  return line;
}

/** The curve of one axis, from 0 to 100 %, with a line at 0 deg. @param {Row} row */
function curve(row) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", `0 0 ${WIDE} ${HIGH}`);
  svg.setAttribute("role", "img");
  svg.setAttribute("aria-label", row.words);
  const [low, high] = [row.angles_deg[0], row.angles_deg[row.angles_deg.length - 1]];
  const at = (/** @type {number} */ angle, /** @type {number} */ percent) => [3 + ((WIDE - 6) * (angle - low)) / (high - low || 1), HIGH - 3 - ((HIGH - 6) * percent) / 100];
  const path = row.angles_deg.map((angle, index) => at(angle, row.acc_percent[index]).map((value) => value.toFixed(1)).join(" ")).join("L");
  const [middle] = at(0, 0);
  svg.append(
    stroke(`M${middle} 2V${HIGH - 2}`, themeColour("line-strong")),
    stroke(`M${path}`, themeColour(row.is_flat ? "attention" : "accent"), 1.6),
  );
  return svg;
}

/** @param {string} path @param {string} colour @param {number} [width] */
function stroke(path, colour, width = 1) {
  const line = document.createElementNS("http://www.w3.org/2000/svg", "path");
  for (const [name, value] of Object.entries({ d: path, fill: "none", stroke: colour, "stroke-width": String(width) })) line.setAttribute(name, value);
  return line;
}

/** @param {import("./messages.js").DataWarning} one */
const warning = (one) => make("p", "acc-warning", [one.message, make("small", "", ` ${one.hint}`)]);
