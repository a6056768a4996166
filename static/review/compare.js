/** Two solutions side by side: chosen here, compared by the server, drawn over the image with two shapes. */

import { fileField, inBase64, LARGEST_FILE } from "../base/asking.js";
import { addLayer } from "../base/layers.js";
import { make, toast } from "../base/notices.js";
import { tell } from "../base/socket.js";
import { clicksIn, emit, nameOf, on, state } from "../base/state.js";
import { toDevice, viewport } from "../image/geometry.js";
import { visible } from "./review.js";

/** @typedef {import("../messages.js").CompareWanted["a"]} Kind */
/** @typedef {import("../messages.js").Compared} Compared */

const A_COLOUR = "#4aaaeb";
const B_COLOUR = "#f09e42";
/** @type {[Kind, string][]} */
const KINDS = [
  ["now", "now"],
  ["before", "before the last change"],
  ["toggled", "without the selected pair"],
  ["default", "default method"],
  ["paper", "the paper's method"],
  ["reference", "given at the start"],
  ["file", "a file…"],
];
/** @type {{a: Kind, b: Kind|""}} */
const chosen = { a: "now", b: "" };
/** @type {{name: string, base64: string}|null} */
let file = null;
let fileSent = false;
let asked = "";
/** Whether the answer to that has not come yet. */
let waiting = false;
/** Whether the tab was shown when it was looked at last. */
let open = false;
/** @type {Compared|null} */
let answer = null;
/** 0 shows A, 1 shows B. */
let blend = 0.5;

const box = make("section", "compare", []);
const selects = { a: make("select", "", []), b: make("select", "", []) };
const rows = make("table", "", []);
const verdict = make("p", "verdict", "");
const slider = make("input", "", []);
const blending = make("div", "blend", []);
const picker = fileField(takeFile, "Calibration file to compare with");

export function startCompare() {
  addLayer("compared", drawCompared);
  const head = make("h2", "", "Compare two solutions");
  const choose = make("button", "", "File…");
  choose.dataset.hint = "Compare with a calibration file of any format, also by dropping it on the page.";
  choose.onclick = () => picker.click();
  box.append(head, make("div", "choice", [side("a", "A"), side("b", "B"), choose, picker]), verdict, rows, blending);
  rows.setAttribute("aria-label", "Difference between A and B");
  verdict.setAttribute("role", "status");
  slider.type = "range";
  Object.assign(slider, { min: "0", max: "1", step: "0.05", value: String(blend) });
  slider.setAttribute("aria-label", "Blend between A and B in the image");
  slider.oninput = () => {
    blend = Number(slider.value);
    emit("layers");
  };
  blending.append(make("span", "", "in the image: A"), slider, make("span", "", "B"));
  document.getElementById("page-review")?.append(box);
  on(["view", "selected"], refresh);
  on(["box"], () => void (visible() !== open && refresh()));
  on(["connection"], () => {
    fileSent = false;
    asked = "";
    refresh();
  });
  draw();
}

/** @param {"a"|"b"} which @param {string} name */
function side(which, name) {
  const menu = selects[which];
  menu.dataset.side = which;
  menu.setAttribute("aria-label", `Solution ${name}`);
  menu.onchange = () => {
    chosen[which] = /** @type {Kind} */ (menu.value);
    if (menu.value === "file" && !file) picker.click();
    refresh();
  };
  return make("label", "", [make("i", `shape ${which}`, []), name, menu]);
}

function drawMenus() {
  for (const which of /** @type {("a"|"b")[]} */ (["a", "b"])) {
    const known = KINDS.filter(([kind]) => kind !== "reference" || state.view?.reference);
    const options = known.map(([kind, label]) => {
      const option = make("option", "", kind === "file" && file ? file.name : kind === "toggled" ? toggledLabel() : label);
      option.value = kind;
      return option;
    });
    const none = make("option", "", "choose…");
    none.value = "";
    selects[which].replaceChildren(...(which === "b" ? [none] : []), ...options);
    selects[which].value = chosen[which];
  }
}

function toggledLabel() {
  const click = state.view?.clicks.find((one) => one.id === state.selected);
  if (!click) return "without the selected pair";
  return `${click.state === "excluded" ? "with" : "without"} ${nameOf(click.id)}`;
}

/** Ask for the comparison, once per answer and choice. */
function refresh() {
  open = visible();
  if (!state.view) return;
  if (visible() && document.activeElement !== selects.a && document.activeElement !== selects.b) drawMenus();
  if (!chosen.b || !state.connected || !visible() || state.view.solving) return draw();
  const pair = chosen.a === "toggled" || chosen.b === "toggled" ? state.selected : null;
  const wanted = JSON.stringify([state.view.revision, chosen, pair, file?.name, fileSent]);
  if (wanted === asked) return draw();
  const message = { type: "compare", a: chosen.a, b: chosen.b, pair };
  if (file && !fileSent) {
    Object.assign(message, { file_name: file.name, file_base64: file.base64 });
    fileSent = true;
  }
  asked = JSON.stringify([state.view.revision, chosen, pair, file?.name, fileSent]);
  waiting = tell(message);
  draw();
}

/** @param {Compared} message */
export function takeCompared(message) {
  answer = message;
  waiting = false;
  draw();
  emit("layers");
}

function draw() {
  const known = answer && chosen.b ? answer : null;
  blending.hidden = !known?.marks.length;
  verdict.hidden = !chosen.b;
  if (waiting) verdict.textContent = "Comparing…";
  else if (known) verdict.textContent = known.problem || `${known.verdict} A: ${known.a}. B: ${known.b}.`;
  if (!known) return rows.replaceChildren();
  rows.replaceChildren(...known.rows.map((row) => make("tr", "", [make("td", "", row.label), make("td", "", row.text)])));
}

/** Compare with a calibration file, where B is not chosen otherwise. @param {File} given */
export async function takeFile(given) {
  if (given.size > LARGEST_FILE) return toast(`${given.name} is too large for a calibration.`, "Give a calibration file: calibration.json, or one of another program.");
  file = { name: given.name, base64: (await inBase64(given)) ?? "" };
  fileSent = false;
  if (chosen.a !== "file") chosen.b = "file";
  drawMenus();
  refresh();
}

/** Draw where A and B put the pairs: circles and squares, joined by a line; those of the frame on screen stand out. @param {CanvasRenderingContext2D} pen */
function drawCompared(pen) {
  if (!answer || !chosen.b || !visible()) return;
  const here = new Set(clicksIn(state.shown?.index ?? -1).map((click) => click.id));
  for (const [id, a, b] of answer.marks) {
    const strong = here.has(id) || id === state.selected;
    if (!strong && !state.layers.others) continue;
    const size = (strong ? 8 : 4.5) * viewport.unit;
    pen.lineWidth = (strong ? 2 : 1.4) * viewport.unit;
    const [shareA, shareB] = [Math.min(1, 2 - 2 * blend), Math.min(1, 2 * blend)];
    if (a && b) {
      pen.globalAlpha = Math.min(shareA, shareB) * (strong ? 0.9 : 0.5);
      pen.strokeStyle = "#ffffff";
      pen.beginPath();
      pen.moveTo(...toDevice(...a));
      pen.lineTo(...toDevice(...b));
      pen.stroke();
    }
    if (a) shape(pen, a, size, A_COLOUR, shareA * (strong ? 1 : 0.75), false);
    if (b) shape(pen, b, size, B_COLOUR, shareB * (strong ? 1 : 0.75), true);
  }
  pen.globalAlpha = 1;
}

/** @param {CanvasRenderingContext2D} pen @param {[number, number]} at @param {number} size @param {string} colour @param {number} alpha @param {boolean} square */
function shape(pen, at, size, colour, alpha, square) {
  const [x, y] = toDevice(...at);
  pen.globalAlpha = alpha;
  pen.beginPath();
  if (square) pen.rect(x - size, y - size, 2 * size, 2 * size);
  else pen.arc(x, y, size, 0, 2 * Math.PI);
  const width = pen.lineWidth;
  pen.lineWidth = width + 2 * viewport.unit;
  pen.strokeStyle = "rgb(0 0 0 / 70%)";
  pen.stroke();
  pen.lineWidth = width;
  pen.strokeStyle = colour;
  pen.stroke();
}
