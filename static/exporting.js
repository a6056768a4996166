/** The export panel: a preview of every format, the direction of its transform, and the clicks. */

import { ask, BROKE_OFF, content } from "./asking.js";
import { IDENTITY, nameFields, parentFields, rectifiedBox } from "./export_fields.js";
import { drawFormats, focusFormats, formatColumn } from "./export_list.js";
import { beforeSaving, checkPoint, lines, numbers } from "./export_parts.js";
import { frameDrawing } from "./frames.js";
import { importer } from "./importing.js";
import { icon, make } from "./notices.js";
import { saveFile } from "./saving.js";
import { on, state } from "./state.js";

/** @typedef {import("./export_list.js").Format} Format */
/** The server's preview of a format: ExportPreview in app/cocalib/web/channel/export_preview.py. @typedef {Record<string, any>} Preview */
const KEPT = "cocalib-export";
const CLICKS = "clicks";
const REPORT = "report";
const IN_REPORT = [
  "Answer: verdict, transform both ways, error bars",
  "Cautions: warnings, and what to do",
  "Uncertainty in the picture at 5, 20 and 60 m",
  "Residuals against range, azimuth, place and time",
  "Coverage of picture and range",
  "Pairs",
  "Provenance: files by their hashes, options, versions",
];
/** What is downloaded as it is, without fields to fill in. @type {Record<string, string>} */
const PLAIN = { [CLICKS]: "api/clicks.json", [REPORT]: "api/report.html" };
const ASKING = "Asking the server for the file…";
const dialog = /** @type {HTMLDialogElement} */ (document.getElementById("export-dialog"));
const button = /** @type {HTMLButtonElement} */ (document.getElementById("export"));
/** @type {Format[]} */
let formats = [];
/** @type {{format: string, parent: string[]}} */
let kept = { format: "json", parent: [...IDENTITY] };
let asked = 0;

const head = make("div", "what", []);
const names = nameFields(() => load());
const rectified = rectifiedBox(() => load());
/** @type {ReturnType<typeof parentFields>} */
let parent;
const before = make("div", "before", []);
const text = make("pre", "text", "");
const notes = make("ul", "notes", []);
const side = make("aside", "", []);
const fileName = make("input", "", []);
const copy = make("button", "second", "Copy");
const save = make("button", "first", "Download");
const retry = make("button", "second", "Try again");

export function startExporting() {
  try {
    kept = { ...kept, ...JSON.parse(localStorage.getItem(KEPT) ?? "{}") };
  } catch {
    // Without storage, the choice is just not remembered.
  }
  build();
  dialog.addEventListener("keydown", trap);
  dialog.addEventListener("cancel", () => /** @type {HTMLElement|null} */ (document.activeElement)?.blur()); // the next key is not for a field that is going
  dialog.addEventListener("click", (event) => {
    if (event.target === dialog) dialog.close();
  });
  retry.onclick = load;
  on(["view"], () => {
    button.classList.toggle("ready", state.view?.has_calibration ?? false);
    if (dialog.open) load();
  });
  on(["recording"], () => {
    names.typed.clear();
    loadFormats();
  });
  on(["connection"], () => {
    if (dialog.open) load(); // the server is back, or gone
  });
}

/** Ask for the formats that the server can write. */
async function loadFormats() {
  const { answer } = await ask("api/formats.json");
  const given = answer && (await content(answer.json()));
  if (!given) return;
  formats = given;
  if (!formats.some((format) => format.key === kept.format) && !(kept.format in PLAIN)) kept.format = "json";
  drawList();
}

export function openExport() {
  if (dialog.open || !state.recording) return;
  drawList();
  drawReason(ASKING);
  dialog.showModal();
  focusFormats();
  load();
}

function build() {
  const close = make("button", "icon close", "×");
  close.setAttribute("aria-label", "Close");
  close.onclick = () => dialog.close();
  const title = make("h2", "", "Export");
  title.id = "export-title";
  text.tabIndex = 0;
  text.setAttribute("aria-label", "File content");
  fileName.type = "text";
  fileName.spellcheck = false;
  fileName.setAttribute("aria-label", "File name");
  fileName.addEventListener("keydown", (event) => {
    if (event.key === "Enter") download();
  });
  copy.onclick = copyText;
  save.onclick = download;
  parent = parentFields(kept.parent, (values) => {
    keep({ parent: values });
    load();
  });
  const list = formatColumn((key) => {
    keep({ format: key });
    load();
  });
  const foot = make("div", "foot", [importer(), make("span", "gap", ""), make("label", "name", ["File name", fileName]), copy, save]);
  dialog.append(make("div", "top", [title, close]), list, make("section", "", [head, names.element, rectified.row, parent.element, before, text, notes]), side, foot);
}

/** The formats, and the clicks and the report as two of them. */
function drawList() {
  const clicks = { key: CLICKS, label: "Clicks, to continue elsewhere", group: "Go on", also: "clicks.json session", takes_parent: false, takes_rectified: false };
  const report = { key: REPORT, label: "Report: how good, where, and why", group: "Go on", also: "report.html pdf print quality", takes_parent: false, takes_rectified: false };
  drawFormats([...formats, clicks, report], kept.format);
}

/** Keep Tab inside the panel. @param {KeyboardEvent} event */
function trap(event) {
  if (event.key !== "Tab") return;
  const stops = /** @type {HTMLElement[]} */ ([...dialog.querySelectorAll("button, input:not([type=file]), label[tabindex], summary, pre")]).filter(
    (stop) => stop.tabIndex >= 0 && !stop.hasAttribute("disabled") && stop.offsetParent !== null,
  );
  const [first, last] = [stops[0], stops[stops.length - 1]];
  const leaving = event.shiftKey ? first : last;
  if (document.activeElement !== leaving) return;
  event.preventDefault();
  (event.shiftKey ? last : first).focus();
}

/** Ask the server for the text of the chosen format; only the newest answer is drawn. */
async function load() {
  const mine = ++asked;
  if (!formats.length) await loadFormats();
  const key = kept.format;
  const { answer, reason, isLost } = await ask(key === CLICKS ? PLAIN[key] : key === REPORT ? "api/preview/json" : address("preview"));
  const said = answer && (await content(key === CLICKS ? answer.text() : answer.json()));
  if (mine !== asked) return;
  if (said === null) drawReason(reason || BROKE_OFF, isLost || !reason);
  else if (key === CLICKS) drawClicks(said);
  else if (said.reason) drawReason(said.reason, false, key === REPORT ? null : said.field);
  else if (key === REPORT) drawReport(said);
  else drawPreview(said);
}

/** @param {"preview"|"export"} kind */
function address(kind) {
  const query = new URLSearchParams();
  if (takesParent() && kept.parent.join() !== IDENTITY.join()) query.set("parent_from_radar", kept.parent.join());
  if (takesRectified() && rectified.box.checked) query.set("rectified", "1");
  for (const [name, value] of names.typed) query.set(name, value);
  return `api/${kind}/${encodeURIComponent(kept.format)}${query.size ? `?${query}` : ""}`;
}

const form = () => formats.find((format) => format.key === kept.format);
const takesParent = () => form()?.takes_parent ?? false;
const takesRectified = () => form()?.takes_rectified ?? false;

/** @param {number} bytes */
const size = (bytes) => (bytes < 1e6 ? `${Math.max(1, Math.round(bytes / 1e3))} kB` : `${(bytes / 1e6).toFixed(1)} MB`);

/** @param {Preview} preview */
function drawPreview(preview) {
  const kind = preview.is_binary ? `binary, ${size(preview.size_bytes)}; contents shown below` : "";
  head.replaceChildren(make("span", "", preview.numbers), make("span", "kind", kind));
  names.draw(preview);
  drawFields({ names: true, parent: takesParent(), rectified: preview.is_for_rectified });
  before.replaceChildren(...beforeSaving(preview));
  show(preview.text, preview.file_name, preview.is_binary);
  notes.replaceChildren(...preview.notes.map((/** @type {string} */ note) => make("li", "", note)));
  side.replaceChildren(
    ...(preview.pose ? [frameDrawing(preview.pose), make("p", "direction", preview.pose.words), ...numbers(preview)] : []),
    ...checkPoint(preview.check_point),
    make("div", `check ${preview.check_is_good ? "good" : "bad"}`, [make("b", "", preview.check_is_good ? "✓" : "!"), make("span", "", preview.check)]),
  );
}

/** @param {string} content */
function drawClicks(content) {
  const count = state.view?.clicks.length ?? 0;
  head.replaceChildren(make("span", "", `${count} click${count === 1 ? "" : "s"} with the stamps of their frames, for cocalib solve or to load on another machine`));
  drawFields({});
  show(content, "clicks.json", false);
  for (const part of [before, notes, side]) part.replaceChildren();
}

/** Say what the report contains; it is written when it is downloaded. @param {Preview} preview of calibration.json */
function drawReport(preview) {
  head.replaceChildren(make("span", "", "One HTML file for a colleague: opens in any browser without a network, prints to at most four pages"));
  drawFields({});
  show(IN_REPORT.join("\n"), "report.html", true);
  notes.replaceChildren();
  before.replaceChildren();
  side.replaceChildren(...(preview.pose ? [frameDrawing(preview.pose), make("p", "direction", preview.pose.words)] : []));
}

/** Show why there is nothing to save yet. @param {string} reason @param {boolean} [canRetry] @param {"frames"|"parent"|"rectified"|null} [field] that has to be filled in or corrected */
function drawReason(reason, canRetry = false, field = null) {
  head.replaceChildren();
  drawFields({ names: field === "frames", parent: field === "parent", rectified: field === "rectified" });
  names.refuse(field === "frames" ? reason : "");
  parent.refuse(field === "parent" ? reason : "");
  const words = field === "frames" || field === "parent" ? "There is no file until the field above is corrected." : reason.trim();
  text.replaceChildren(make("div", "reason", [...(reason === ASKING ? [] : [icon("warning")]), make("span", "", words), ...(canRetry ? [retry] : [])]));
  for (const part of [before, notes, side]) part.replaceChildren();
  fileName.value = "";
  for (const control of [fileName, copy, save]) control.disabled = true;
}

/** Show these fields, with nothing wrong in them. @param {{names?: boolean, parent?: boolean, rectified?: boolean}} shown */
function drawFields(shown) {
  names.element.hidden = !shown.names;
  parent.element.hidden = !shown.parent;
  rectified.row.hidden = !shown.rectified;
  for (const fields of [names, parent]) fields.refuse("");
}

/** @param {string} content @param {string} name @param {boolean} isBinary */
function show(content, name, isBinary) {
  if (fileName.dataset.suggested !== name || !fileName.value) fileName.value = name;
  fileName.dataset.suggested = name;
  text.replaceChildren(...lines(content));
  text.scrollTop = 0;
  for (const control of [fileName, save]) control.disabled = false;
  copy.disabled = isBinary;
}

async function copyText() {
  const content = text.textContent ?? "";
  try {
    await navigator.clipboard.writeText(content);
  } catch {
    getSelection()?.selectAllChildren(text); // without HTTPS, a page on another machine has only this clipboard
    document.execCommand("copy");
  }
  copy.classList.add("done");
  setTimeout(() => copy.classList.remove("done"), 1600);
}

/** Download the file under the name in the field; if the server refuses, show why. */
async function download() {
  if (save.disabled) return;
  const name = fileName.value.trim() || String(fileName.dataset.suggested);
  const unsaved = await saveFile(PLAIN[kept.format] ?? address("export"), name);
  if (unsaved) drawReason(unsaved.reason, unsaved.isLost);
}

/** @param {Partial<typeof kept>} change */
function keep(change) {
  Object.assign(kept, change);
  try {
    localStorage.setItem(KEPT, JSON.stringify(kept));
  } catch {
    // Without storage, the choice is just not remembered.
  }
}
