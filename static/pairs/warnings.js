/**
 * The warnings: one line says how many there are and opens the list, the gravest first; each unfolds to what to do about it. Those of the
 * recording are in its sheet. Where a calibration does not state what its numbers mean, one picks the meaning here, each drawn over the
 * frame on the screen.
 */

import { ask, content } from "../base/asking.js";
import { showPage } from "../base/layout.js";
import { icon, make, toast } from "../base/notices.js";
import { send } from "../base/socket.js";
import { on, onPainted, said, state } from "../base/state.js";
import { notes, openAgain } from "../opening/opening.js";
import { openOption } from "../options/options.js";

/** @typedef {import("../messages.js").WarningRow} WarningRow */
/** @typedef {import("../messages.js").AssumptionRow} AssumptionRow */
const box = /** @type {HTMLElement} */ (document.getElementById("warnings"));
const opener = /** @type {HTMLElement} */ (document.getElementById("warning-count"));
/** How many notes there are on the recording: in the header, beside its name. */
const noted = /** @type {HTMLElement} */ (document.getElementById("recording-notes"));
/** What the user has unfolded stays so. @type {Set<string>} */
const openCodes = new Set(["no-camera", "assumed", "calibration-ambiguous"]);
/** What leaves open what a calibration means: a person picks. */
const TO_PICK = ["calibration-ambiguous", "calibration-picked"];
let drawn = "";

export function startWarnings() {
  opener.onclick = () => toggle(box.hidden);
  onPainted(["view", "recording"], drawAll);
  on(["recording"], look);
}

/** @param {boolean} open */
function toggle(open) {
  box.hidden = !open;
  opener.setAttribute("aria-expanded", String(open));
}

function drawAll() {
  const [view, recording] = [state.view, state.recording];
  if (!view || !recording) return;
  const { acknowledged, assumptions } = view;
  const text = JSON.stringify([view.warnings, recording.warnings, assumptions, acknowledged]);
  if (text === drawn) return;
  drawn = text;
  const asks = recording.warnings.filter((one) => TO_PICK.includes(one.code));
  drawList(box, [...view.warnings, ...asks], acknowledged, []);
  drawList(notes, recording.warnings.filter((one) => !asks.includes(one)), acknowledged, assumptions.length ? [assumptionBox(assumptions)] : []);
  const count = unread(box);
  opener.hidden = !box.childElementCount;
  opener.replaceChildren(icon("warning"), `${count} warning${count === 1 ? "" : "s"}`);
  if (opener.hidden) toggle(false);
  else if (state.looking) toggle(true);
  noted.textContent = unread(notes) ? String(unread(notes)) : "";
  noted.classList.toggle("asks", assumptions.length > 0);
}

/** @param {HTMLElement} list */
const unread = (list) => list.querySelectorAll(":scope > .warning").length;

/** @param {HTMLElement} list @param {WarningRow[]} rows @param {string[]} acknowledged codes of those that the user has read @param {HTMLElement[]} first */
function drawList(list, rows, acknowledged, first) {
  const read = rows.filter(({ code }) => acknowledged.includes(code));
  const held = list.contains(document.activeElement) ? document.activeElement?.closest("[data-code]")?.getAttribute("data-code") : null;
  list.replaceChildren(
    ...first,
    ...rows.filter((one) => !read.includes(one)).map((one) => row(one, false)),
    ...(read.length ? [folded("acknowledged", "acknowledged", `${read.length} acknowledged`, read.map((one) => row(one, true)))] : []),
  );
  if (held) /** @type {HTMLElement|null} */ (list.querySelector(`[data-code="${CSS.escape(held)}"] > summary`))?.focus({ preventScroll: true });
}

/** @param {WarningRow} warning @param {boolean} read */
function row(warning, read) {
  /** @type {HTMLElement[]} */
  const inside = [make("div", "hint", said(warning.hint))];
  if (TO_PICK.includes(warning.code)) {
    const pick = make("button", "pick", "Pick a meaning…");
    pick.onclick = openMeanings;
    inside.push(pick);
  }
  if (warning.kind === "CalibrateLens") {
    const open = make("button", "pick", "Open Lens");
    open.onclick = () => showPage("lens");
    inside.push(open);
  }
  if (warning.option) {
    const set = make("button", "pick", "Open this option");
    set.onclick = () => openOption(warning.option);
    inside.push(set);
  }
  if (warning.code !== "no-camera") {
    const button = make("button", "acknowledge", read ? "Show again" : "Acknowledge");
    button.onclick = async () => {
      const refusal = await send({ type: "warnings_acknowledged", codes: [warning.code], acknowledged: !read });
      if (refusal) toast(refusal);
    };
    inside.push(button);
  }
  return folded(warning.code, "warning", said(warning.message), inside);
}

/** A line that unfolds. @param {string} code @param {string} className @param {string} line @param {HTMLElement[]} inside */
function folded(code, className, line, inside) {
  const made = make("details", className, [make("summary", "", [icon("warning"), make("span", "", line)]), ...inside]);
  made.dataset.code = code;
  made.open = openCodes.has(code);
  made.ontoggle = () => (made.open ? openCodes.add(code) : openCodes.delete(code));
  return made;
}

/** What the recording does not state, with a button that confirms all of it. @param {AssumptionRow[]} rows */
function assumptionBox(rows) {
  const confirm = make("button", "", "Confirm");
  confirm.id = "confirm-assumptions";
  confirm.onclick = async () => {
    const refusal = await send({ type: "assumptions_confirmed", texts: rows.map((one) => one.text) });
    if (refusal) toast(refusal);
  };
  const title = rows.length === 1 ? "One assumption about the recording is unconfirmed" : `${rows.length} assumptions about the recording are unconfirmed`;
  const items = rows.map((one) => make("li", "", [one.words, make("div", "hint", one.hint)]));
  return folded("assumed", "warning", title, [confirm, make("ul", "", items)]);
}

/** @typedef {{meaning: string, place: string, score: string, words: string, mounting: string, is_shown: boolean}} Row */

const dialog = /** @type {HTMLDialogElement} */ (document.getElementById("meanings-dialog"));
/** @type {{name: string, rows: Row[]}|null} */
let known = null;
/** The frame that is drawn on. */
let frame = -1;

/** Show the meanings once if the calibration needs a pick. */
function look() {
  const waits = state.recording?.warnings.some((warning) => warning.code === "calibration-ambiguous");
  if (waits && !known) openMeanings();
}

/** Show the meanings to pick from, drawn over the frame on the screen. */
async function openMeanings() {
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
  const why = make("p", "why", "The file does not state it. Pick the image in which the radar returns lie on what they come from; other frames may tell more.");
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
    dialog.querySelectorAll("img").forEach((image, number) => (image.src = address(number)));
  };
  return make("label", "frames", [make("span", "", "frame"), slider]);
}

/** @param {number} number */
const address = (number) => `/api/meaning.jpg?number=${number}&frame=${frame}`;

/** @param {Row} row @param {number} number */
function card(row, number) {
  const image = make("img", "", []);
  image.src = address(number);
  image.alt = `Returns under ${row.meaning}: ${row.mounting}`;
  const shown = row.is_shown ? [make("em", "", "Shown now")] : [];
  const parts = [image, make("strong", "", `${row.score}: ${row.mounting}`), make("small", "", row.words), ...shown];
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
