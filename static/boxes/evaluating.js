/**
 * The sheet "Evaluate": while it is open, boxes are drawn on the picture; it lists them and says what they say about the calibration:
 * Acc, each class, and how Acc changes when the camera is turned, which says what it can see at all.
 */

import { setRectified } from "../picture/rectified.js";
import { saveFile } from "../shell/asking.js";
import { themeColour } from "../shell/colours.js";
import { closeSheet, showPage } from "../shell/layout.js";
import { make, shape, toast } from "../shell/notices.js";
import { send, tell } from "../shell/socket.js";
import { emit, on, onPainted, state } from "../shell/state.js";
import { goTo } from "../time/player.js";
import { boxing, colourOf, selectBox, selectedBox, selectedTrack, shownBoxes } from "./boxes.js";
import { hideHere, newBox, removeBox, setEdge, setLabel } from "./boxing.js";

/** @typedef {import("./boxes.js").Track} Track */

const page = /** @type {HTMLElement} */ (document.getElementById("page-evaluate"));
const SIDES = ["left", "top", "right", "bottom"];
const edit = make("section", "box-edit", []);
const body = make("tbody", "", []);
const table = make("table", "pairs boxes", [make("thead", "", [make("tr", "", ["Object", "Frames", "Boxes", "Keyframes"].map((name) => make("th", "", name)))]), body]);
const empty = make("p", "box-empty", "");
const label = make("input", "", []);
const labels = make("datalist", "", []);
/** @type {HTMLInputElement[]} */
const edges = SIDES.map(() => make("input", "", []));
const hide = make("button", "second", "Hidden here");
const remove = make("button", "second", "Delete");
const add = make("button", "second", "New box");
const edgeRow = make("div", "edges", [make("span", "", "Edges"), ...edges, make("span", "unit", "px")]);
const files = make("div", "box-files", []);
const stop = make("button", "second", "Stop following");
const save = make("button", "second", "Download boxes");
const picker = make("input", "", []);
/** A larger file is not sent: a message of 4 MB is the limit [bytes]. */
const LARGEST_FILE = 2_800_000;
let drawn = "";

export function startEvaluating() {
  buildEdit();
  buildFiles();
  page.append(edit, accSection(), table, empty, files);
  body.addEventListener("click", pressed);
  on(["box"], follow);
  onPainted(["view", "boxes", "shown", "recording"], draw);
  follow();
}

/** Open the sheet, or close it. */
export const toggleEvaluate = () => (page.hidden ? showPage("evaluate") : closeSheet());

/** Boxes take the pointer while the sheet is open. */
function follow() {
  const open = !page.hidden && !state.looking;
  if (open === boxing.on) return;
  boxing.on = open;
  if (open) setRectified(false);
  document.body.classList.toggle("boxing", open);
  emit("boxes");
}

function buildEdit() {
  label.setAttribute("list", "box-labels");
  label.setAttribute("aria-label", "Class");
  label.dataset.hint = "Class of the selected box, and of the next one that you draw. Choose one, or type another. (R)";
  label.maxLength = 60;
  label.spellcheck = false;
  label.autocomplete = "off";
  label.onchange = () => setLabel(label.value);
  labels.id = "box-labels";
  edges.forEach((field, index) => {
    field.type = "number";
    field.step = "1";
    field.setAttribute("aria-label", `${SIDES[index]} edge [px]`);
    field.oninput = () => field.value !== "" && setEdge(/** @type {0|1|2|3} */ (index), Number(field.value));
  });
  hide.dataset.hint = "The object is hidden, or out of the picture, from this frame on. (H)";
  remove.dataset.hint = "Delete all boxes of this object. (Del)";
  add.dataset.hint = "A new box in the middle of the picture, for those who do not drag. (Enter)";
  hide.onclick = hideHere;
  remove.onclick = removeBox;
  add.onclick = newBox;
  edit.append(
    make("label", "", ["Class", label, labels]),
    edgeRow,
    make("div", "acts", [add, hide, remove]),
  );
}

/** Boxes from and to files. */
function buildFiles() {
  const load = make("button", "second", "Load boxes…");
  load.dataset.hint = "Boxes of a labelling tool or of a detector: boxes.json, COCO, YOLO, CVAT, KITTI, OpenLABEL… They take the place of all boxes here. Dropping the file on this sheet does the same.";
  save.dataset.hint = "All boxes, as boxes.json: for cocalib evaluate --boxes, or to load again.";
  stop.dataset.hint = "Leave the boxes where they have been followed to so far.";
  load.onclick = chooseBoxes;
  save.onclick = downloadBoxes;
  stop.onclick = stopFollowing;
  picker.type = "file";
  picker.hidden = true;
  picker.setAttribute("aria-label", "File of boxes");
  picker.onchange = async () => {
    if (picker.files?.[0]) await takeBoxes(picker.files[0]);
    picker.value = "";
  };
  files.append(load, save, stop, picker);
  page.addEventListener("dragover", (event) => event.preventDefault());
  page.addEventListener("drop", (event) => {
    const dropped = event.dataTransfer?.files[0];
    if (!dropped) return;
    event.preventDefault();
    event.stopPropagation();
    document.body.classList.remove("dropping");
    takeBoxes(dropped);
  });
}

/** Choose a file of boxes. */
export const chooseBoxes = () => picker.click();

/** Leave the boxes where they have been followed to. */
export const stopFollowing = () => tell({ type: "stop_following" });

/** @param {File} given */
async function takeBoxes(given) {
  if (given.size > LARGEST_FILE) return toast(`${given.name} is too large for the page.`, "Give it to cocalib evaluate --boxes instead.");
  const bytes = new Uint8Array(await given.arrayBuffer());
  let text = "";
  for (let at = 0; at < bytes.length; at += 32768) text += String.fromCharCode(...bytes.subarray(at, at + 32768));
  const refusal = await send({ type: "load_boxes", name: given.name, content_base64: btoa(text) });
  if (refusal) toast(refusal);
}

/** Download all boxes. */
export async function downloadBoxes() {
  const unsaved = await saveFile("api/boxes.json", "boxes.json");
  if (unsaved) toast(unsaved.reason, "Try again.");
}

/** Put the focus into the class. */
export function editLabel() {
  if (page.hidden) showPage("evaluate");
  label.focus();
  label.select();
}

function draw() {
  const tracks = state.view?.boxes ?? [];
  if (page.hidden) return;
  drawEdit();
  drawAcc();
  stop.hidden = !tracks.some((track) => track.following);
  save.disabled = !tracks.length;
  const text = JSON.stringify([tracks, boxing.selected, shownBoxes().map((box) => box.id)]);
  if (text === drawn) return;
  drawn = text;
  table.hidden = !tracks.length;
  empty.textContent = tracks.length ? "" : "Drag a box around someone who walks, or a car that drives, in the picture. It is followed through the frames; correct it where it drifts. What the radar sees moving is then compared with the boxes.";
  empty.hidden = tracks.length > 0;
  body.replaceChildren(...tracks.map(line));
}

function drawEdit() {
  const [track, box] = [selectedTrack(), selectedBox()];
  if (document.activeElement !== label) label.value = track ? track.label : boxing.label;
  const names = state.view?.box_labels ?? [];
  if (labels.childElementCount !== names.length || [...labels.children].some((option, index) => /** @type {HTMLOptionElement} */ (option).value !== names[index]))
    labels.replaceChildren(...names.map((name) => Object.assign(make("option", "", ""), { value: name })));
  edges.forEach((field, index) => {
    field.disabled = !box;
    if (document.activeElement !== field) field.value = box ? box.edges[index].toFixed(0) : "";
  });
  edgeRow.hidden = !box;
  hide.disabled = !track || state.cursor <= track.first;
  remove.disabled = !track;
}

/** @param {Track} track */
function line(track) {
  const chip = make("i", "box-colour", "");
  chip.style.background = colourOf(track.id);
  const here = shownBoxes().some((box) => box.id === track.id);
  const frames = track.first === track.last ? String(track.first + 1) : `${track.first + 1}–${track.last + 1}`;
  const row = make("tr", "row", [
    make("td", "", [make("span", "name", [chip, track.id, make("span", "label", track.label || "no class")])]),
    make("td", "", frames),
    make("td", "", track.following ? `${track.boxes} …` : String(track.boxes)),
    make("td", "", track.keyframes.length ? String(track.keyframes.length) : "from a file"),
  ]);
  row.dataset.id = track.id;
  row.setAttribute("aria-selected", String(track.id === boxing.selected));
  row.classList.toggle("here", here);
  if (track.note) {
    row.classList.add("noted");
    row.dataset.hint = track.note;
  }
  return row;
}

/** Select an object, and go to its box where this frame has none. @param {MouseEvent} event */
function pressed(event) {
  const row = event.target instanceof Element ? /** @type {HTMLElement|null} */ (event.target.closest("tr.row")) : null;
  const track = state.view?.boxes.find((one) => one.id === row?.dataset.id);
  if (!track) return;
  selectBox(track.id);
  if (state.cursor < track.first || state.cursor > track.last) goTo(track.first);
}

/** What to do next with boxes, in one line on the picture. @returns {import("../pairs/guide.js").Advice} */
export function boxAdvice() {
  const [track, box] = [selectedTrack(), selectedBox()];
  if (!state.view?.boxes.length) return { text: ["Drag a box around someone who moves.", { key: "A", label: "back to the clicks", action: "evaluate" }], act: true };
  if (!track) return { text: ["Click a box to select it, or drag a new one"], act: false };
  if (!box) return { text: [`${track.id} has no box in this frame: drag one to go on with it.`, { key: "Esc", label: "another object", action: "deselect-box" }], act: false };
  if (track.note && state.cursor === track.last) return { text: [track.note], act: true };
  if (box.kind === "between") return { text: [`${track.id} was lost before this frame: its box is drawn straight to the next keyframe. Drag it where it is off`], act: true };
  return { text: [`${track.id}: drag to move, handles resize`, { key: "H", label: "hidden from here on", action: "hide-box" }, { key: ".", label: "next keyframe", action: "keyframe-forward" }], act: false };
}

/** @typedef {import("../messages.js").AccPanel} Panel */
/** @typedef {import("../messages.js").SensitivityRow} Row */

const box = make("section", "acc", []);
const WIDE = 92;
const HIGH = 26;
let drawnAcc = "";

/** The section of the sheet. */
function accSection() {
  box.setAttribute("aria-label", "What the boxes say");
  on(["theme"], () => {
    drawnAcc = "";
    drawAcc();
  });
  return box;
}

function drawAcc() {
  const panel = state.view?.acc;
  box.hidden = !panel || !(panel.figures.length || panel.problem || panel.judging);
  if (!panel || box.hidden) return;
  const text = JSON.stringify(panel);
  if (text === drawnAcc) return;
  drawnAcc = text;
  box.classList.toggle("stale", panel.judging && panel.figures.length > 0);
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
    make("tbody", "", panel.classes.map((row) => make("tr", "", [row.label || "without a box", row.acc === null ? "–" : `${(100 * row.acc).toFixed(1)} %`, String(row.frames), `${row.inside} of ${row.returns}`].map((cell) => make("td", "", cell))))),
  ]);
  const angles = make("table", "acc-angles", [
    make("caption", "", "Acc of the camera turned about one axis: where it is flat, or highest elsewhere, it cannot judge that angle"),
    make("thead", "", [make("tr", "", ["Axis", "−1°", "0°", "+1°", ""].map((name) => make("th", "", name)))]),
    make("tbody", "", panel.sensitivity.map(angleRow)),
  ]);
  const rule = make("details", "acc-rule", [make("summary", "", "Which returns count"), make("p", "", panel.rule)]);
  return [make("p", "acc-caution", panel.caution), figures, ...(panel.sensitivity.length ? [angles] : []), classes, rule];
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

/** @param {import("../messages.js").DataWarning} one */
const warning = (one) => make("p", "acc-warning", [one.message, make("small", "", ` ${one.hint}`)]);
