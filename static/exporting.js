// @ts-check
/** The export panel: a preview of every format, the direction of its transform, and the clicks. */

import { warningBox, lines, numbers, rectifiedBox } from "./export_parts.js";
import { frameDrawing } from "./frames.js";
import { icon, make, toast } from "./notices.js";
import { send } from "./socket.js";
import { on, state } from "./state.js";

/** @typedef {{key: string, label: string, takes_parent: boolean, takes_rectified: boolean}} Format */
/** The server's preview of a format: ExportPreview in app/web/channel/export_preview.py. @typedef {Record<string, any>} Preview */
const KEPT = "cocalib-export";
const CLICKS = "clicks";
const PARENT = ["x", "y", "z", "qx", "qy", "qz", "qw"];
const IDENTITY = ["0", "0", "0", "0", "0", "0", "1"];
const TYPING_MS = 250;
const dialog = /** @type {HTMLDialogElement} */ (document.getElementById("export-dialog"));
const button = /** @type {HTMLButtonElement} */ (document.getElementById("export"));
/** @type {Format[]} */
let formats = [];
/** @type {{format: string, parent: string[]}} */
let kept = { format: "json", parent: [...IDENTITY] };
let asked = 0;
let parentTimer = 0;

const list = make("div", "formats", []);
const head = make("div", "what", []);
const parent = make("div", "parent", []);
const rectified = rectifiedBox(() => load());
const text = make("pre", "text", "");
const notes = make("ul", "notes", []);
const side = make("aside", "", []);
const fileName = make("input", "", []);
const copy = make("button", "second", "Copy");
const save = make("button", "first", "Download");
const clicksFile = make("input", "", []);

export function startExporting() {
  try {
    kept = { ...kept, ...JSON.parse(localStorage.getItem(KEPT) ?? "{}") };
  } catch {
    // Without storage, the choice is just not remembered.
  }
  build();
  dialog.addEventListener("keydown", trap);
  dialog.addEventListener("click", (event) => {
    if (event.target === dialog) dialog.close();
  });
  on(["view"], () => {
    button.classList.toggle("ready", state.view?.has_calibration ?? false);
    if (dialog.open) load();
  });
}

/** The formats that the server can write. @param {Format[]} given */
export function setFormats(given) {
  formats = given;
  if (!given.some((format) => format.key === kept.format) && kept.format !== CLICKS) kept.format = "json";
  drawList();
}

export function openExport() {
  if (dialog.open || !state.recording) return;
  drawList();
  dialog.showModal();
  /** @type {HTMLElement|null} */ (list.querySelector('[aria-selected="true"]'))?.focus();
  list.querySelector('[aria-selected="true"]')?.scrollIntoView({ block: "nearest" });
  load();
}

function build() {
  const close = make("button", "icon close", "×");
  close.setAttribute("aria-label", "Close");
  close.onclick = () => dialog.close();
  const title = make("h2", "", "Export");
  title.id = "export-title";
  list.setAttribute("role", "listbox");
  list.setAttribute("aria-label", "Format");
  list.addEventListener("keydown", walk);
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
  parent.append(...parentFields());
  const foot = make("footer", "", [importer(), make("span", "gap", ""), make("label", "name", ["File name", fileName]), copy, save]);
  dialog.append(make("header", "", [title, close]), list, make("section", "", [head, rectified.row, parent, text, notes]), side, foot);
}

function drawList() {
  list.replaceChildren(
    ...formats.map((format) => option(format.key, format.label)),
    make("hr", "", []),
    option(CLICKS, "Clicks, to continue elsewhere"),
  );
}

/** @param {string} key @param {string} label */
function option(key, label) {
  const item = make("button", "", [make("span", "", label), make("code", "", key)]);
  item.setAttribute("role", "option");
  item.dataset.export = key;
  const chosen = key === kept.format;
  item.setAttribute("aria-selected", String(chosen));
  item.tabIndex = chosen ? 0 : -1;
  item.onclick = () => choose(key);
  return item;
}

/** @param {string} key */
function choose(key) {
  keep({ format: key });
  for (const item of /** @type {NodeListOf<HTMLElement>} */ (list.querySelectorAll("[data-export]"))) {
    const chosen = item.dataset.export === key;
    item.setAttribute("aria-selected", String(chosen));
    item.tabIndex = chosen ? 0 : -1;
    if (chosen) item.focus();
  }
  load();
}

/** The up and down keys move through the list and select. @param {KeyboardEvent} event */
function walk(event) {
  const items = /** @type {HTMLElement[]} */ ([...list.querySelectorAll("[data-export]")]);
  const at = items.findIndex((item) => item.dataset.export === kept.format);
  const to = /** @type {Record<string, number>} */ ({ ArrowDown: at + 1, ArrowUp: at - 1, Home: 0, End: items.length - 1 })[event.key];
  if (to === undefined) return;
  event.preventDefault();
  const next = items[Math.max(0, Math.min(items.length - 1, to))];
  choose(next.dataset.export ?? "json");
  next.scrollIntoView({ block: "nearest" });
}

/** Keep Tab inside the panel. @param {KeyboardEvent} event */
function trap(event) {
  if (event.key !== "Tab") return;
  const stops = /** @type {HTMLElement[]} */ ([...dialog.querySelectorAll("button, input:not([type=file]), label[tabindex], pre")]).filter(
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
  const key = kept.format;
  const answer = await fetch(key === CLICKS ? "api/clicks.json" : address("preview"));
  const said = answer.ok && key !== CLICKS ? await answer.json() : await answer.text();
  if (mine !== asked) return;
  if (!answer.ok || said.reason) drawReason(said.reason ?? said);
  else if (key === CLICKS) drawClicks(said);
  else drawPreview(said);
}

/** @param {"preview"|"export"} kind */
function address(kind) {
  const query = new URLSearchParams();
  if (takesParent() && kept.parent.join() !== IDENTITY.join()) query.set("parent_from_radar", kept.parent.join());
  if (takesRectified() && rectified.box.checked) query.set("rectified", "1");
  return `api/${kind}/${encodeURIComponent(kept.format)}${query.size ? `?${query}` : ""}`;
}

const form = () => formats.find((format) => format.key === kept.format);
const takesParent = () => form()?.takes_parent ?? false;
const takesRectified = () => form()?.takes_rectified ?? false;

/** @param {Preview} preview */
function drawPreview(preview) {
  const kind = preview.is_binary ? `binary, ${preview.size_bytes} bytes; contents shown below` : "";
  head.replaceChildren(make("span", "", preview.numbers), make("span", "kind", kind));
  parent.hidden = !takesParent();
  rectified.row.hidden = !preview.is_for_rectified;
  show(preview.text, preview.file_name, preview.is_binary);
  notes.replaceChildren(...preview.notes.map((/** @type {string} */ note) => make("li", "", note)));
  side.replaceChildren(
    frameDrawing(preview),
    numbers(preview),
    make("div", `check ${preview.check_is_good ? "good" : "bad"}`, [make("b", "", preview.check_is_good ? "✓" : "!"), make("span", "", preview.check)]),
    ...warningBox(preview.warnings),
  );
}

/** @param {string} content */
function drawClicks(content) {
  const count = state.view?.clicks.length ?? 0;
  head.replaceChildren(make("span", "", `${count} click${count === 1 ? "" : "s"} with the stamps of their frames, for cocalib solve or to load on another machine`));
  parent.hidden = true;
  rectified.row.hidden = true;
  show(content, "clicks.json", false);
  notes.replaceChildren();
  side.replaceChildren();
}

/** Show why there is nothing to save yet. @param {string} reason */
function drawReason(reason) {
  head.replaceChildren();
  const inParent = takesParent() && reason.includes("parent");
  parent.hidden = !inParent;
  rectified.row.hidden = !(takesRectified() && reason.includes("rectified"));
  text.replaceChildren(make("div", "reason", [icon("warning"), make("span", "", reason.trim())]));
  notes.replaceChildren();
  side.replaceChildren();
  fileName.value = "";
  for (const control of [fileName, copy, save]) control.disabled = true;
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

function parentFields() {
  const label = make("span", "", "Radar pose in the kit, rig or ego frame");
  label.dataset.hint = "parent_from_radar: position in metres, rotation as a quaternion in the order x y z w. By default the radar is the origin.";
  const fields = PARENT.map((name, index) => {
    const field = make("input", "", []);
    field.type = "text";
    field.inputMode = "decimal";
    field.value = kept.parent[index] ?? IDENTITY[index];
    field.setAttribute("aria-label", `${name} of the radar in the parent frame`);
    field.addEventListener("input", () => {
      const values = /** @type {HTMLInputElement[]} */ ([...parent.querySelectorAll("input")]).map((input) => input.value.trim());
      keep({ parent: values.map((value, at) => value || IDENTITY[at]) });
      clearTimeout(parentTimer);
      parentTimer = window.setTimeout(load, TYPING_MS);
    });
    return make("label", "", [name, field]);
  });
  return [label, make("div", "", fields)];
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
  const answer = await fetch(kept.format === CLICKS ? "api/clicks.json" : address("export"));
  if (!answer.ok) return drawReason(await answer.text());
  const url = URL.createObjectURL(await answer.blob());
  const anchor = make("a", "", []);
  [anchor.href, anchor.download] = [url, fileName.value.trim() || String(fileName.dataset.suggested)];
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

function importer() {
  clicksFile.type = "file";
  clicksFile.accept = ".json,application/json";
  clicksFile.onchange = async () => {
    const file = clicksFile.files?.[0];
    if (!file) return;
    dialog.close();
    const refusal = await send({ type: "import_clicks", text: await file.text(), name: file.name });
    if (refusal) toast(refusal);
    clicksFile.value = "";
  };
  const open = make("button", "second", "Load clicks…");
  open.dataset.hint = "Add the clicks from a clicks.json. In frames that already have a click, they replace it.";
  open.onclick = loadClicks;
  return make("span", "", [open, clicksFile]);
}

/** Ask for a file of clicks, and add them. */
export function loadClicks() {
  clicksFile.click();
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
