/**
 * The page Deliver: a preview of every format, with its numbers, its check point and what it rests on; the report, as it is; the
 * clicks, saved or added from a file.
 */

import { register, withImages } from "../base/actions.js";
import { ask, BROKE_OFF, content, fileField, saveFile } from "../base/asking.js";
import { showPage } from "../base/layout.js";
import { icon, make, shape, toast } from "../base/notices.js";
import { send } from "../base/socket.js";
import { on, said, state } from "../base/state.js";
import { despiteBox, frameDrawing, IDENTITY, nameFields, parentFields, rectifiedBox, returnsChoice } from "./fields.js";
import { drawFormats, focusFormats, formatColumn } from "./list.js";

/** @typedef {import("./list.js").Format} Format */
/** The server's preview of a format: ExportPreview in app/cocalib/web/channel/export_preview.py. @typedef {Record<string, any>} Preview */
const KEPT = "cocalib-export";
const CLICKS = "clicks";
const REPORT = "report";
const RERUN = "rerun";
/** What is downloaded as it is, without fields to fill in. @type {Record<string, string>} */
const PLAIN = { [CLICKS]: "api/clicks.json", [REPORT]: "api/report.html", [RERUN]: "api/view.rrd" };
/** What is asked for to show it. @type {Record<string, string>} */
const SHOWN = { [CLICKS]: PLAIN[CLICKS], [REPORT]: "api/preview/json", [RERUN]: "api/rerun.json" };
const ASKING = "Asking the server for the file…";
const page = /** @type {HTMLElement} */ (document.getElementById("page-deliver"));
/** @type {Format[]} */
let formats = [];
/** @type {{format: string, parent: string[]}} */
let kept = { format: "json", parent: [...IDENTITY] };
let asked = 0;
/** The state of the session that is shown. */
let drawn = "";

const head = make("div", "what", []);
const names = nameFields(() => load());
const rectified = rectifiedBox(() => load());
const returns = returnsChoice(() => load());
const despite = despiteBox(() => load());
/** @type {ReturnType<typeof parentFields>} */
let parent;
const before = make("div", "before", []);
const text = make("pre", "text", "");
const report = make("iframe", "report", []);
const notes = make("ul", "notes", []);
const side = make("div", "side", []);
const fileName = make("input", "", []);
const copy = make("button", "second", "Copy");
const save = make("button", "first", "Download");
const retry = make("button", "second", "Try again");

export function startExporting() {
  register(
    { id: "export", group: "File", words: "Export the calibration, the report or the clicks", keys: ["E"], also: "deliver tab save download write file json yaml urdf tf format", run: () => openExport(), when: withImages },
    { id: "report", group: "File", words: "Show the accuracy report", also: "html pdf print quality colleague", run: () => openExport(REPORT), when: withImages },
    { id: "rerun", group: "File", words: "Open in Rerun", also: "rrd viewer show 3d window", run: () => openExport(RERUN), when: withImages },
    { id: "load-clicks", group: "File", words: "Load clicks from a file", also: "import open clicks.json", run: loadClicks, when: withImages },
  );
  try {
    kept = { ...kept, ...JSON.parse(localStorage.getItem(KEPT) ?? "{}") };
  } catch {
    // Without storage, the choice is just not remembered.
  }
  build();
  retry.onclick = load;
  on(["view", "box"], loadChanged);
  on(["recording"], () => {
    names.typed.clear();
    loadFormats();
  });
  on(["connection"], load); // the server is back, or gone
}

/** Ask for the chosen format again, if the page is shown and the session has changed. */
function loadChanged() {
  const { revision, solved_revision, solving, has_calibration } = state.view ?? {};
  const now = [revision, solved_revision, solving, has_calibration].join();
  if (page.hidden || !state.recording || now === drawn) return;
  drawn = now;
  load();
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

/** @param {string} [format] the one before if none is given */
function openExport(format = kept.format) {
  drawn = "";
  keep({ format });
  drawList();
  showPage("deliver");
  focusFormats();
}

function build() {
  text.tabIndex = 0;
  text.setAttribute("aria-label", "File content");
  report.title = "Report";
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
    returns.chosen = "";
    load();
  });
  const foot = make("div", "foot", [make("span", "gap", ""), make("label", "name", [make("span", "", "File name"), fileName]), copy, save]);
  page.append(list, make("section", "", [head, loader, names.element, returns.row, rectified.row, despite.row, parent.element, before, text, report, notes]), side, foot);
  drawList();
  drawReason(ASKING);
}

/** The formats, and what else can be taken along as some of them. */
function drawList() {
  const others = [
    [CLICKS, "Clicks, to continue elsewhere", "clicks.json session"],
    [REPORT, "Report: how good, where, and why", "report.html pdf print quality"],
    [RERUN, "Rerun: images and returns over time", "view.rrd 3d show open"],
  ].map(([key, label, also]) => ({ key, label, group: "Go on", also, takes_parent: false, takes_rectified: false }));
  drawFormats([...formats, ...others], kept.format);
}

/** Ask the server for the text of the chosen format; only the newest answer is drawn. */
async function load() {
  if (page.hidden || !state.recording) return;
  const mine = ++asked;
  if (!formats.length) await loadFormats();
  const key = kept.format;
  const { answer, reason, isLost } = await ask(SHOWN[key] ?? address("preview"));
  const said = answer && (await content(key === CLICKS ? answer.text() : answer.json()));
  if (mine !== asked) return;
  if (said === null) drawReason(reason || BROKE_OFF, isLost || !reason);
  else if (key === CLICKS) drawClicks(said);
  else if (said.reason) drawReason(said.reason, false, key === REPORT ? null : said.field);
  else if (key === REPORT) drawReport();
  else if (key === RERUN) drawRerun(said);
  else drawPreview(said);
}

/** @param {"preview"|"export"} kind */
function address(kind) {
  const query = new URLSearchParams();
  if (takesParent() && kept.parent.join() !== IDENTITY.join()) query.set("parent_from_radar", kept.parent.join());
  if (takesRectified() && rectified.box.checked) query.set("rectified", "1");
  if (returns.chosen) query.set("returns", returns.chosen);
  if (!despite.row.hidden && despite.box.checked) query.set("despite_verdict", "1");
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
  returns.draw(preview.other_pose);
  drawFields({ names: true, parent: takesParent(), rectified: preview.is_for_rectified, returns: preview.other_pose !== null, despite: preview.asks_despite_verdict });
  before.replaceChildren(...beforeSaving(preview));
  show(preview.text, preview.file_name, preview.is_binary);
  if (!despite.row.hidden && !despite.box.checked) for (const control of [copy, save]) control.disabled = true;
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

/** Show the report as it is. */
function drawReport() {
  head.replaceChildren(make("span", "", "One HTML file for a colleague: opens in any browser without a network, prints to at most four pages"));
  drawFields({});
  show("", "report.html", true);
  [text.hidden, report.hidden] = [true, false];
  report.src = `${PLAIN[REPORT]}?shown=1`;
  for (const part of [before, notes, side]) part.replaceChildren();
}

/** Show how Rerun is opened. @param {{command: string, is_installed: boolean, opens_window: boolean}} offer */
function drawRerun({ command, is_installed: isInstalled, opens_window: opensWindow }) {
  const [words, line] = !isInstalled
    ? ["rerun-sdk is not installed on this server. This installs it:", "pip install 'cocalib[rerun]'"]
    : opensWindow
      ? ["Images, returns and pairs over time. Download the file, or open a window with the calibration that the format json saves:", command]
      : ["Images, returns and pairs over time. This server can open no window: download the file, and open it on your computer:", "rerun view.rrd"];
  head.replaceChildren(make("span", "", words));
  drawFields({});
  show(`${line}\n`, "view.rrd", false);
  save.disabled = !isInstalled;
  for (const part of [before, notes, side]) part.replaceChildren();
}

/** Show why there is nothing to save yet. @param {string} reason @param {boolean} [canRetry] @param {"frames"|"parent"|"rectified"|null} [field] that has to be filled in or corrected */
function drawReason(reason, canRetry = false, field = null) {
  head.replaceChildren();
  drawFields({ names: field === "frames", parent: field === "parent", rectified: field === "rectified" });
  names.refuse(field === "frames" ? reason : "");
  parent.refuse(field === "parent" ? reason : "");
  const words = field === "frames" || field === "parent" ? "There is no file until the field above is corrected." : reason.trim();
  [text.hidden, report.hidden] = [false, true];
  text.replaceChildren(make("div", "reason", [...(reason === ASKING ? [] : [icon("warning")]), make("span", "", words), ...(canRetry ? [retry] : [])]));
  for (const part of [before, notes, side]) part.replaceChildren();
  fileName.value = "";
  for (const control of [fileName, copy, save]) control.disabled = true;
}

/** Show these fields, with nothing wrong in them. @param {{names?: boolean, parent?: boolean, rectified?: boolean, returns?: boolean, despite?: boolean}} shown */
function drawFields(shown) {
  loader.hidden = kept.format !== CLICKS;
  names.element.hidden = !shown.names;
  parent.element.hidden = !shown.parent;
  rectified.row.hidden = !shown.rectified;
  returns.row.hidden = !shown.returns;
  despite.row.hidden = !shown.despite;
  for (const fields of [names, parent]) fields.refuse("");
}

/** @param {string} content @param {string} name @param {boolean} isBinary */
function show(content, name, isBinary) {
  if (fileName.dataset.suggested !== name || !fileName.value) fileName.value = name;
  fileName.dataset.suggested = name;
  [text.hidden, report.hidden] = [false, true];
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
  save.disabled = true;
  const unsaved = await saveFile(PLAIN[kept.format] ?? address("export"), name, (progress) => (save.textContent = progress));
  save.textContent = "Download";
  save.disabled = false;
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

const field = fileField(takeClicks, "Clicks file");

/** Add the clicks of a file. @param {File} file */
export async function takeClicks(file) {
  const refusal = await send({ type: "import_clicks", text: await file.text(), name: file.name });
  if (refusal) toast(refusal);
}

/** Ask for a file of clicks, and add them. */
function loadClicks() {
  field.click();
}
field.onclick = (event) => event.stopPropagation();

/** The button, shown with the clicks, and the field behind it. */
const loader = make("div", "loader", [make("button", "second", "Load clicks…"), field]);
loader.dataset.hint = "Add the clicks from a clicks.json. In frames that already have a click, they replace it.";
loader.onclick = loadClicks;

/** FileNumbers of app/cocalib/web/exports.py. @typedef {{title: string, rows: {name: string, values: string[], unit: string}[]}} Numbers */
/** CheckPointRow of app/cocalib/web/exports.py. @typedef {{words: string, u_px: number, v_px: number, width_px: number, height_px: number, pair: string}} CheckPoint */
/** How much of the image's width the inset shows, and its shape. */
const INSET = 0.36;
const INSET_ASPECT = 0.34;

/** The text with its comments dimmed. @param {string} content */
function lines(content) {
  let inside = false;
  return content.split(/(?<=\n)/).map((line) => {
    const opens = line.includes("<!--");
    const isComment = inside || opens || /^\s*(#|%)/.test(line);
    inside = (inside || opens) && !line.includes("-->");
    return isComment ? make("i", "", line) : line;
  });
}

/** The file's own numbers; folded below what follows from them, and the calibration's. @param {Record<string, any>} preview */
function numbers({ pose, our_pose }) {
  const isChained = pose.in_third_frame.length > 0;
  const own = (isChained ? pose.in_third_frame : [pose.numbers]).map(table);
  for (const one of own) one.dataset.hint = "Read back from the file: its own numbers in its own order and units. Matrices are rounded to 9 decimals here; the file has all digits.";
  const below = isChained ? [pose.numbers, our_pose] : [our_pose];
  return [...own, ...below.map((one) => make("details", "ours", [make("summary", "", one.title), table(one)]))];
}

/** @param {Numbers} given */
function table({ title, rows }) {
  const most = Math.max(...rows.map((row) => row.values.length));
  const lines = rows.map(({ name, values, unit }) => {
    const cells = values.map((value) => make("td", "", value));
    if (cells.length === 1) cells[0].colSpan = most;
    return make("tr", "", [make("th", "", unit ? `${name} [${unit}]` : name), ...cells]);
  });
  return make("table", "pose-numbers", [make("caption", "", title), ...lines]);
}

/** The check point: in a cut-out of the image, and in one sentence. @param {CheckPoint|null} point */
function checkPoint(point) {
  if (!point) return [];
  const figure = make("figure", "check-point", [make("figcaption", "", [make("b", "", "Check point. "), point.words])]);
  if (point.pair) figure.append(inset(point, () => figure.querySelector("svg")?.remove()));
  return [figure];
}

/** A cut-out of the image around the check point, with a mark on it. @param {CheckPoint} point @param {() => void} failed */
function inset({ u_px, v_px, width_px, height_px, pair }, failed) {
  const width = Math.max(INSET * width_px, 160);
  const height = width * INSET_ASPECT;
  const [u, v] = [u_px + 0.5, v_px + 0.5]; // pixel (0, 0) is the centre of the first one
  const left = Math.max(0, Math.min(width_px - width, u - width / 2));
  const top = Math.max(0, Math.min(height_px - height, v - height / 2));
  const svg = shape("svg", { viewBox: `${left} ${top} ${width} ${height}`, class: "inset", role: "img", "aria-label": "The check point in the image" });
  const image = shape("image", { href: `api/check_point_image?${encodeURIComponent(pair)}`, width: width_px, height: height_px });
  image.addEventListener("error", failed);
  const radius = 0.035 * width;
  const arm = (/** @type {number} */ from, /** @type {number} */ to) => `M${u + from} ${v}H${u + to}M${u} ${v + from}V${v + to}`;
  const path = `${arm(-1.7 * radius, -0.35 * radius)}${arm(0.35 * radius, 1.7 * radius)}`;
  svg.append(image);
  for (const name of ["rim", "mark"]) {
    const mark = shape("g", { class: name });
    mark.append(shape("circle", { cx: u, cy: v, r: radius }), shape("path", { d: path }));
    svg.append(mark);
  }
  return svg;
}

/** What is to be known before saving: what the pose rests on, what the file cannot hold, the warnings. @param {Record<string, any>} preview */
function beforeSaving(preview) {
  const missing = preview.missing ? [make("div", "missing", [icon("warning"), make("strong", "", preview.missing)])] : [];
  return [make("div", "evidence", preview.evidence), ...missing, ...warningBox()];
}

/** The warnings that the panel's head counts: the verdict, above, says its own cause. */
function warningBox() {
  const rows = (state.view?.warnings ?? []).filter(({ code }) => !state.view?.acknowledged.includes(code));
  if (!rows.length) return [];
  const title = rows.length === 1 ? "This calibration has 1 warning" : `This calibration has ${rows.length} warnings`;
  const items = rows.map((row) => {
    const item = make("li", "", said(row.message));
    item.dataset.hint = said(row.hint);
    return item;
  });
  const box = make("details", "with-warnings", [make("summary", "", [icon("warning"), title]), make("ul", "", items)]);
  box.open = true;
  return [box];
}
