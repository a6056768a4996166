/** The tab "Evaluate": while it is open, boxes are drawn on the picture; it lists them and says what they say about the calibration. */

import { accSection, drawAcc } from "./acc.js";
import { boxing, colourOf, selectBox, selectedBox, selectedTrack, shownBoxes } from "./boxes.js";
import { hideHere, newBox, removeBox, setEdge, setLabel } from "./boxing.js";
import { showTab } from "./layout.js";
import { make, toast } from "./notices.js";
import { goTo } from "./player.js";
import { setRectified } from "./rectified.js";
import { saveFile } from "./saving.js";
import { send, tell } from "./socket.js";
import { emit, on, state } from "./state.js";

/** @typedef {import("./boxes.js").Track} Track */

const page = /** @type {HTMLElement} */ (document.getElementById("page-evaluate"));
const count = /** @type {HTMLElement} */ (document.getElementById("box-count"));
const SIDES = ["left", "top", "right", "bottom"];
/** The tab to go back to. */
let before = "tab-pairs";
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
const large = make("button", "second", "⤢");
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
  on(["view", "boxes", "shown", "recording"], draw);
  follow();
}

/** Open the tab, or go back to the one before. */
export function toggleEvaluate() {
  if (page.hidden) before = document.querySelector('#tabs [aria-selected="true"]')?.id ?? before;
  showTab(page.hidden ? "tab-evaluate" : before);
}

/** Give the tab the whole column, or the 3D view its place back. */
function enlarge() {
  document.body.classList.toggle("review-large");
  emit("box");
}

/** Boxes take the pointer while the tab is open. */
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
  large.dataset.hint = "Give this tab the whole column, or the 3D view its place back.";
  large.setAttribute("aria-label", "Enlarge");
  large.onclick = enlarge;
  hide.onclick = hideHere;
  remove.onclick = removeBox;
  add.onclick = newBox;
  edit.append(
    make("label", "", ["Class", label, labels]),
    edgeRow,
    make("div", "acts", [add, hide, remove, large]),
  );
}

/** Boxes from and to files. */
function buildFiles() {
  const load = make("button", "second", "Load boxes…");
  load.dataset.hint = "Boxes of a labelling tool or of a detector: boxes.json, COCO, YOLO, CVAT, KITTI, OpenLABEL… They take the place of all boxes here. Dropping the file on this tab does the same.";
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
  if (page.hidden) showTab("tab-evaluate");
  label.focus();
  label.select();
}

function draw() {
  const tracks = state.view?.boxes ?? [];
  count.textContent = tracks.length ? String(tracks.length) : "";
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

/** What to do next with boxes, in one line on the picture. @returns {{text: (string|{key: string})[], act: boolean}|null} */
export function boxAdvice() {
  const [track, box] = [selectedTrack(), selectedBox()];
  if (!state.view?.boxes.length) return { text: ["Drag a box around someone who moves. Wheel: zoom, ", { key: "Shift" }, "+drag: pan, ", { key: "A" }, ": back to the clicks"], act: true };
  if (!track) return { text: ["Click a box to select it, or drag a new one"], act: false };
  if (!box) return { text: [`${track.id} has no box in this frame: drag one to go on with it. `, { key: "Esc" }, " for another object"], act: false };
  if (track.note && state.cursor === track.last) return { text: [track.note], act: true };
  if (box.kind === "between") return { text: [`${track.id} was lost before this frame: its box is drawn straight to the next keyframe. Drag it where it is off`], act: true };
  return { text: [`${track.id}: drag to move, handles resize, `, { key: "H" }, " hidden from here on, ", { key: "." }, " next keyframe"], act: false };
}
