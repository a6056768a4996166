/**
 * Picking what a calibration means whose numbers do not state it: each meaning is drawn over the frame on the screen, and the one
 * that is picked is shown as the calibration.
 */

import { ask, content } from "./asking.js";
import { make, toast } from "./notices.js";
import { openAgain } from "./opening.js";
import { on, state } from "./state.js";

/** @typedef {{meaning: string, place: string, score: string, words: string, mounting: string, is_shown: boolean}} Row */

const dialog = /** @type {HTMLDialogElement} */ (document.getElementById("meanings-dialog"));
/** @type {{name: string, rows: Row[]}|null} */
let known = null;
/** The frame that is drawn on. */
let frame = -1;

export function startMeanings() {
  on(["recording"], look);
}

/** Show the meanings once if the calibration needs a pick. */
function look() {
  const waits = state.recording?.warnings.some((warning) => warning.code === "calibration-ambiguous");
  if (waits && !known) openMeanings();
}

/** Show the meanings to pick from, drawn over the frame on the screen. */
export async function openMeanings() {
  const { answer, reason } = await ask("api/meanings.json");
  const given = answer && (await content(answer.json()));
  if (!given?.rows.length) return toast(reason || "This calibration states what its numbers mean.");
  known = given;
  draw();
  if (!dialog.open) dialog.showModal();
}

function draw() {
  if (!known) return;
  frame = Math.max(0, state.shown?.index ?? 0);
  const title = make("h2", "", `What does ${known.name} mean?`);
  title.id = "meanings-title";
  const close = make("button", "icon close", "×");
  close.setAttribute("aria-label", "Close");
  close.onclick = () => dialog.close();
  const why = make("p", "why", "The file does not state it. Pick the picture in which the radar returns lie on what they come from; other frames may tell more.");
  const rows = make("div", "meanings", known.rows.map(card));
  dialog.replaceChildren(make("div", "top", [title, close]), why, frames(), rows);
}

/** Go to another frame: some moments tell more than others. */
function frames() {
  const slider = make("input", "", []);
  const count = state.recording?.frame_times.sec.length ?? 1;
  Object.assign(slider, { type: "range", min: "0", max: String(count - 1), value: String(frame) });
  slider.setAttribute("aria-label", "Frame to draw on");
  slider.onchange = () => {
    frame = Number(slider.value);
    dialog.querySelectorAll("img").forEach((picture, number) => (picture.src = address(number)));
  };
  return make("label", "frames", [make("span", "", "frame"), slider]);
}

/** @param {number} number */
const address = (number) => `/api/meaning.jpg?number=${number}&frame=${frame}`;

/** @param {Row} row @param {number} number */
function card(row, number) {
  const picture = make("img", "", []);
  picture.src = address(number);
  picture.alt = `Returns under ${row.meaning}: ${row.mounting}`;
  const shown = row.is_shown ? [make("em", "", "Shown now")] : [];
  const parts = [picture, make("strong", "", `${row.score}: ${row.mounting}`), make("small", "", row.words), ...shown];
  if (known && new Set(known.rows.map((one) => one.place)).size > 1) parts.push(make("small", "", `at ${row.place}`));
  const button = make("button", "meaning", parts);
  button.dataset.meaning = row.meaning;
  if (row.is_shown) button.setAttribute("aria-current", "true");
  button.onclick = () => (row.is_shown ? dialog.close() : pick(row));
  return button;
}

/** @param {Row} row */
async function pick(row) {
  dialog.classList.add("busy");
  await openAgain({ meaning: row.meaning, meaning_place: row.place });
  dialog.classList.remove("busy");
}
