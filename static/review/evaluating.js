/**
 * The sheet "Evaluate": what boxes around moving objects say about the calibration. The boxes are those of a file, or around what moves:
 * Acc, each class, and how Acc changes when the camera is turned, which says what it can see at all.
 */

import { register, withImages } from "../base/actions.js";
import { fileField, inBase64, LARGEST_FILE } from "../base/asking.js";
import { themeColour } from "../base/colours.js";
import { closeSheet, showPage } from "../base/layout.js";
import { make, shape, toast } from "../base/notices.js";
import { send, tell } from "../base/socket.js";
import { on, said } from "../base/state.js";

/** @typedef {import("../messages.js").AccPanel} Panel */
/** @typedef {import("../messages.js").SensitivityRow} Row */

const page = /** @type {HTMLElement} */ (document.getElementById("page-evaluate"));
const figures = make("section", "acc", []);
const about = make("p", "acc-about", "");
const find = make("button", "second", "Find what moves");
const picker = fileField(takeBoxes, "File of boxes");
const WIDE = 92;
const HIGH = 26;
/** @type {Panel|null} */
let panel = null;

export function startEvaluating() {
  register(
    { id: "evaluate", group: "Panel", words: "Evaluate: judge the calibration by boxes around what moves, or go back", keys: ["A"], also: "sheet boxes annotations acc accuracy bounding people cars moving", run: toggleEvaluate, when: withImages },
    { id: "find-moving", group: "Panel", words: "Evaluate: find what moves before a camera that stands still", also: "boxes motion detect", run: findMoving, when: withImages },
    { id: "load-boxes", group: "File", words: "Load boxes from a file", also: "import open coco yolo cvat kitti openlabel annotations", run: chooseBoxes, when: withImages },
  );
  const load = make("button", "second", "Load boxes…");
  load.dataset.hint = "Boxes of a labeling tool or of a detector: boxes.json, COCO, YOLO, CVAT, KITTI, OpenLABEL… Dropping the file on the page does the same.";
  find.dataset.hint = "Boxes around whatever moves before a camera that stands still.";
  load.onclick = chooseBoxes;
  find.onclick = findMoving;
  figures.setAttribute("aria-label", "What the boxes say");
  page.append(make("div", "box-files", [load, find, picker]), about, figures);
  on(["theme"], draw);
}

/** Open the sheet, or close it. */
const toggleEvaluate = () => (page.hidden ? showPage("evaluate") : closeSheet());

/** Choose a file of boxes. */
const chooseBoxes = () => picker.click();

/** Judge by boxes around what moves. */
const findMoving = () => tell({ type: "find_moving" });

/** Judge by the boxes of a file. @param {File} given */
export async function takeBoxes(given) {
  if (given.size > LARGEST_FILE) return toast(`${given.name} is too large for the page.`, "Give it to cocalib evaluate --boxes instead.");
  const refusal = await send({ type: "load_boxes", name: given.name, content_base64: await inBase64(given) });
  if (refusal) toast(refusal);
}

/** Take what the boxes say. @param {Panel} message */
export function takeAcc(message) {
  panel = message;
  draw();
}

function draw() {
  if (!panel) return;
  const { source, boxes, frames, figures: known, problem, warnings, busy } = panel;
  find.disabled = busy;
  about.textContent = source ? `${source}: ${boxes} boxes in ${frames} frames` : "Boxes around people, cars or whatever else moves say how many of the radar's moving returns the calibration puts into them.";
  figures.hidden = !(known.length || problem || busy);
  figures.classList.toggle("stale", busy && known.length > 0);
  figures.setAttribute("aria-busy", String(busy));
  figures.replaceChildren(...(known.length ? parts(panel) : [make("p", "acc-problem", problem || "Comparing boxes and radar…")]), ...warnings.map(warning));
}

/** @param {Panel} panel */
function parts(panel) {
  const values = make("dl", "acc-figures", panel.figures.map(({ label, value, unit, hint, level, key }) => {
    const one = make("div", `figure ${level}`, [make("dt", "", label), make("dd", "", [value, make("span", "unit", unit)])]);
    one.dataset.hint = hint;
    one.dataset.acc = key;
    one.tabIndex = 0;
    return one;
  }));
  const classes = make("table", "acc-classes", [
    make("thead", "", [make("tr", "", ["Class", "Acc", "Frames", "Returns inside"].map((name) => make("th", "", name)))]),
    make("tbody", "", panel.classes.map((row) => make("tr", "", [row.label || "without a box", row.acc === null ? "–" : `${(100 * row.acc).toFixed(1)} %`, String(row.frames), `${row.inside} of ${row.returns}`].map((cell) => make("td", "", cell))))),
  ]);
  const angles = make("table", "acc-angles", [
    make("caption", "", "Acc of the camera turned about one axis: where it is flat, or highest elsewhere, it cannot judge that angle"),
    make("thead", "", [make("tr", "", ["Axis", "−1°", "0°", "+1°", ""].map((name) => make("th", "", name)))]),
    make("tbody", "", panel.sensitivity.map(angleRow)),
  ]);
  const rule = make("details", "acc-rule", [make("summary", "", "Which returns count"), make("p", "", panel.rule)]);
  return [make("p", "acc-caution", panel.caution), values, ...(panel.sensitivity.length ? [angles] : []), classes, rule];
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
  const [low, high] = [row.angles_deg[0], row.angles_deg[row.angles_deg.length - 1]];
  const at = (/** @type {number} */ angle, /** @type {number} */ percent) => [3 + ((WIDE - 6) * (angle - low)) / (high - low || 1), HIGH - 3 - ((HIGH - 6) * percent) / 100];
  const path = row.angles_deg.map((angle, index) => at(angle, row.acc_percent[index]).map((value) => value.toFixed(1)).join(" ")).join("L");
  const [middle] = at(0, 0);
  const stroke = (/** @type {string} */ d, /** @type {string} */ colour, width = 1) => shape("path", { d, fill: "none", stroke: themeColour(colour), "stroke-width": width });
  const lines = [stroke(`M${middle} 2V${HIGH - 2}`, "line-strong"), stroke(`M${path}`, row.is_flat ? "attention" : "accent", 1.6)];
  return shape("svg", { viewBox: `0 0 ${WIDE} ${HIGH}`, role: "img", "aria-label": row.words }, lines);
}

/** @param {import("../messages.js").WarningRow} one */
const warning = (one) => make("p", "acc-warning", [said(one.message), make("small", "", ` ${said(one.hint)}`)]);
