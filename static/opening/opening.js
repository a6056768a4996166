/**
 * Choosing what is opened and how: the dialog behind "Recording…" with its parts, which the server also opens with a question, the strip
 * on a recording without intrinsics.
 */

import { register } from "../base/actions.js";
import { fileField, inBase64 } from "../base/asking.js";
import { showPage } from "../base/layout.js";
import { make, toast } from "../base/notices.js";
import { send, tell, unconfirmed } from "../base/socket.js";
import { on, said, state } from "../base/state.js";

/** @typedef {import("../messages.js").OpeningChoices} Choices */
/** What the user has chosen in the dialog so far. @typedef {{recent: string, paths: Set<string>, radar: string|null, image: string|null, intrinsics: "keep"|"recorded"|"near"|"file", file: {name: string, data: string, camera: string}|null, session: "continue"|"new"|"copy"}} Draft */

/** Files of intrinsics have a few kB; the server refuses more than this as well. */
const MAX_FILE_BYTES = 512 * 1024;
const dialog = /** @type {HTMLDialogElement} */ (document.getElementById("opening-dialog"));
const pane = /** @type {HTMLElement} */ (document.getElementById("image-pane"));
const strip = make("div", "", "");
/** What is to be known of the recording that is open; pairs/warnings.js draws it. */
export const notes = make("section", "notes", []);
/** @type {Choices|null} */
let choices = null;
/** @type {Draft} */
let draft = emptyDraft();
/** @type {import("../messages.js").FolderListing|null} */
let folder = null;
let problem = "";
let busy = false;
/** Called with the next choices. @type {(() => void)[]} */
let waiting = [];

export function startOpening() {
  register({ id: "recording", group: "File", words: "Choose another recording, other topics, intrinsics or session", also: "open new session file folder recent camera radar topic intrinsics", run: chooseRecording });
  strip.id = "intrinsics-strip";
  strip.hidden = true;
  pane.append(strip);
  on(["recording", "lens"], drawStrip);
  on(["opening", "recording"], () => {
    document.body.classList.remove("asking");
    busy = false;
    if (dialog.open) dialog.close();
  });
  dialog.addEventListener("cancel", (event) => {
    if (!state.recording) event.preventDefault(); // there is nothing behind it
  });
}

/** @returns {Draft} */
function emptyDraft() {
  return { recent: "", paths: new Set(), radar: null, image: null, intrinsics: "keep", file: null, session: "continue" };
}

/** Whether the server has opened another recording, or this one in another way: the page then starts again, once all is confirmed. @param {import("../messages.js").RecordingNote} message */
export function isAnother(message) {
  const before = state.recording;
  if (!before || before.opening === message.opening) return false;
  const same = before.frame_times.sec.length === message.frame_times.sec.length && before.start.sec === message.start.sec && before.start.nanosec === message.start.nanosec;
  if (!same) sessionStorage.removeItem("cocalib-frame");
  const again = () => (unconfirmed() ? setTimeout(again, 50) : location.reload());
  again();
  return true;
}

/** @param {Choices} message */
export function takeChoices(message) {
  const isNew = message.question !== choices?.question;
  choices = message;
  if (isNew) {
    draft = { ...emptyDraft(), radar: message.radar_topic, image: message.image_topic, session: message.session.plan };
    folder = null;
    busy = false;
    problem = "";
  }
  for (const ready of waiting.splice(0)) ready();
  if (!message.is_open) {
    document.body.classList.add("asking");
    if (message.root && !folder) tell({ type: "folder", path: "" });
    draw();
    if (!dialog.open) dialog.showModal();
  } else if (dialog.open) draw();
}

/** @param {import("../messages.js").FolderListing} message */
export function takeFolder(message) {
  folder = message;
  if (dialog.open) draw();
}

/** Ask what can be chosen, and show it. */
async function chooseRecording() {
  if (dialog.open) return;
  if (state.recording) {
    draw(); // what is known of it, until the server says what can be chosen
    dialog.showModal();
  }
  if (!(await known())) return;
  if (choices?.root && !folder) tell({ type: "folder", path: "" });
  draw();
  if (!dialog.open && !state.recording) dialog.showModal();
}

/** Wait for the present choices. @returns {Promise<boolean>} whether the server can be asked */
async function known() {
  if (!tell({ type: "choices" })) {
    toast("Not connected to the server.", "Try again when it is back.");
    return false;
  }
  await new Promise((ready) => waiting.push(() => ready(true)));
  return true;
}

function draw() {
  const title = make("h2", "", !choices || choices.is_open || !choices.name ? "Recording" : `${choices.name} cannot be opened as it is`);
  title.id = "opening-title";
  title.tabIndex = -1;
  title.autofocus = true;
  const words = problem || (choices?.problem ?? "");
  const box = make("p", "problem", words);
  box.setAttribute("role", "alert");
  box.hidden = !words;
  const scrolled = dialog.querySelector(".parts")?.scrollTop ?? 0;
  dialog.replaceChildren(make("div", "head", [title, close()]), box, make("div", "parts", [notes, drawReading(), ...(choices ? drawChoices(choices) : [])]), ...(choices ? [footer()] : []));
  /** @type {HTMLElement} */ (dialog.querySelector(".parts")).scrollTop = scrolled;
}

/** @param {Choices} choices */
function drawChoices(choices) {
  const tools = { choices, draft, folder, redraw: draw, give, choose, enter, forget };
  const parts = choices.name ? [drawTopics(tools, "radar"), drawTopics(tools, "image"), drawIntrinsics(tools), drawSession(tools)] : [];
  return [...parts, drawOthers(tools)];
}

function close() {
  const button = make("button", "icon close", "×");
  button.setAttribute("aria-label", "Close");
  button.onclick = () => dialog.close();
  button.hidden = !state.recording;
  return button;
}

function footer() {
  const another = draft.recent !== "" || draft.paths.size > 0;
  const open = make("button", "primary", busy ? "Opening…" : another || !choices?.is_open ? "Open" : "Open again this way");
  open.disabled = busy || (!another && !choices?.name);
  open.onclick = choose;
  const kept = choices?.is_open ? "Clicks are on disk; they stay where the frames are the same." : "";
  return make("div", "foot", [make("span", "", kept), open]);
}

/** Send what was chosen; words that refuse it are shown in the dialog, and nothing has changed. */
async function choose() {
  if (!choices || busy) return;
  busy = true;
  problem = "";
  draw();
  const { recent, paths, radar, image, intrinsics, file, session } = draft;
  const answer = crypto.getRandomValues(new Uint32Array(4)).join("-");
  const refused = await send({ type: "open_with", question: choices.question, answer, recent, paths: [...paths], radar_topic: radar, image_topic: image, intrinsics, file, session });
  if (refused === null) return;
  busy = false;
  problem = refused;
  if (dialog.open) return draw();
  toast(refused);
}

/** Open what is open again in another way, without asking. @param {{meaning: string, meaning_place: string}} changed */
export async function openAgain(changed) {
  if (!(await known()) || !choices) return;
  const answer = crypto.getRandomValues(new Uint32Array(4)).join("-");
  const { question, radar_topic, image_topic } = choices;
  const refused = await send({ type: "open_with", question, answer, radar_topic, image_topic, intrinsics: "keep", session: "continue", ...changed });
  if (refused !== null) toast(refused);
}

/** Use a file of intrinsics: in the dialog it is chosen, outside it is used at once. @param {File} file */
export async function give(file) {
  const refuse = (/** @type {string} */ words) => {
    problem = words;
    if (dialog.open) draw();
    else toast(words);
  };
  if (file.size > MAX_FILE_BYTES) return refuse(`${file.name} has ${(file.size / 1e6).toFixed(1)} MB, and a file of intrinsics has a few kB. Drop the YAML, XML or JSON file of the camera.`);
  const data = await inBase64(file);
  if (data === null) return refuse(`${file.name} cannot be read by the browser; a folder cannot be dropped. Choose the file itself.`);
  problem = "";
  if (!dialog.open && !(await known())) return;
  draft.intrinsics = "file";
  draft.file = { name: file.name, data, camera: "" };
  if (dialog.open) draw();
  else choose();
}

/** Look into a folder. @param {string} path */
function enter(path) {
  if (!tell({ type: "folder", path })) toast("Not connected to the server.");
}

async function forget() {
  const refused = await send({ type: "forget_recent" });
  if (refused) toast(refused);
}

/** What is missing or unclear about the recording: intrinsics, or which radar is meant. */
function drawStrip() {
  const recording = state.recording;
  strip.hidden = true;
  if (!recording) return;
  const radars = recording.warnings.find((warning) => warning.code === "several-radars");
  if (recording.has_images && !recording.intrinsics) askIntrinsics();
  else if (radars && !recording.session.restored_clicks) askRadar(said(radars.message));
}

/** @param {string} message */
function askRadar(message) {
  const pick = make("button", "chip", "Choose…");
  pick.onclick = chooseRecording;
  const close = make("button", "chip", "Keep it");
  close.onclick = () => (strip.hidden = true);
  strip.replaceChildren(make("span", "", message), pick, close);
  strip.hidden = false;
}

function askIntrinsics() {
  strip.hidden = false;
  const input = fileField(give, "Camera file");
  const pick = make("button", "chip", "Choose file…");
  pick.onclick = () => input.click();
  const calibrate = make("button", "chip", "Calibrate…");
  calibrate.onclick = () => showPage("lens");
  const others = make("button", "chip", "More…");
  others.onclick = chooseRecording;
  strip.replaceChildren(make("span", "", [make("strong", "", "No camera intrinsics. "), "You can click now. For a pose, calibrate the lens or drop its file here."]), calibrate, pick, others, input);
}

/** @typedef {{choices: Choices, draft: Draft, folder: import("../messages.js").FolderListing|null, redraw: () => void, give: (file: File) => void, choose: () => void, enter: (path: string) => void, forget: () => void}} Tools */

/** @param {string} title @param {(Node|string)[]} content */
const section = (title, content) => make("section", "", [make("h3", "", title), ...content]);

/**
 * A row that can be chosen.
 * @param {{group: string, label: string, about: string, checked: boolean, disabled?: boolean, choose: () => void, kind?: "radio"|"checkbox"}} row
 */
function option({ group, label, about, checked, disabled = false, choose, kind = "radio" }) {
  const input = make("input", "", "");
  input.type = kind;
  input.name = group;
  input.checked = checked;
  input.disabled = disabled;
  input.onchange = choose;
  const made = make("label", disabled ? "choice off" : "choice", [input, make("span", "name", label), make("small", "", about)]);
  return made;
}

/** How the recording that is open is read: clocks, axes, units. */
function drawReading() {
  const rows = (state.recording?.sensors ?? []).flatMap(({ name, topic, about }) => [make("p", "why", [make("strong", "", `${name}: ${topic}`), ...about.map((line) => make("div", "", line))])]);
  const box = make("details", "reading", [make("summary", "", "How it is read"), ...rows]);
  box.hidden = !rows.length;
  return box;
}

/** The radars or the cameras of the recording. @param {Tools} tools @param {"radar"|"image"} which */
function drawTopics({ choices, draft, redraw }, which) {
  const rows = which === "radar" ? choices.radars : choices.cameras;
  const title = which === "radar" ? "Radar" : "Camera";
  if (!rows.length) return section(title, [make("p", "none", choices.is_open ? "None in this recording." : "None was found in it.")]);
  const reason = which === "radar" && choices.radar_reason ? [make("p", "why", `In use: ${choices.radar_reason}.`)] : [];
  const options = rows.map(({ value, about, used, problem }) =>
    option({
      group: which, label: value, about: problem ? `cannot be used: ${problem}` : about, disabled: problem !== "",
      checked: draft[which] === null ? used : draft[which] === value,
      choose: () => {
        draft[which] = value;
        redraw();
      },
    }),
  );
  return section(title, [...options, ...reason]);
}

/** The intrinsics: those in use, the recording's, those beside it, or a file. @param {Tools} tools */
function drawIntrinsics({ choices, draft, redraw, give }) {
  const input = fileField(give, "Camera file");
  const pick = make("button", "drop", draft.file ? `${draft.file.name}: drop or choose another file` : "Drop a camera file anywhere, or choose one… (camera_info YAML, OpenCV YAML or XML, Kalibr, JSON)");
  pick.onclick = () => input.click();
  /** @type {[Draft["intrinsics"], string, string, boolean][]} */
  const rows = [
    ["keep", choices.intrinsics || "none", choices.intrinsics ? "in use" : "clicks are kept; there is no pose", true],
    ["recorded", "the recording's own", "", choices.recorded_intrinsics && choices.intrinsics_file],
    ["near", choices.intrinsics_near, "lies next to the recording", choices.intrinsics_near !== "" && choices.intrinsics_near !== choices.intrinsics],
    ["file", draft.file?.name ?? "", "from this computer", draft.file !== null],
  ];
  const options = rows.filter(([, , , offered]) => offered).map(([value, label, about]) =>
    option({
      group: "intrinsics", label, about, checked: draft.intrinsics === value,
      choose: () => {
        draft.intrinsics = value;
        redraw();
      },
    }),
  );
  return section("Intrinsics", [...options, pick, input, ...(draft.intrinsics === "file" && draft.file ? [whichCamera(draft.file)] : [])]);
}

/** A field for the name of a camera in a file with several. @param {{camera: string}} file */
function whichCamera(file) {
  const input = make("input", "", "");
  input.type = "text";
  input.value = file.camera;
  input.placeholder = "only if it has several, such as cam0";
  input.oninput = () => (file.camera = input.value.trim());
  return make("label", "which", ["Camera in the file", input]);
}

/** The session: continue, start anew, or copy the clicks that fit. @param {Tools} tools */
function drawSession({ choices, draft, redraw }) {
  const { folder, clicks, recording, continues } = choices.session;
  if (!folder) return make("span", "", "");
  const held = `${clicks} ${clicks === 1 ? "click" : "clicks"}`;
  /** @type {[Draft["session"], string, string][]} */
  const rows = [
    ["continue", "Keep my clicks", continues ? `${held}, ${folder}` : `if that in ${folder} is of these frames; another one is left alone`],
    ["new", "New session", "the one there is kept under another name"],
    ["copy", "New session, copy matching clicks", `${held} of ${recording || folder}: those whose frames this recording has`],
  ];
  const options = rows.map(([value, label, about]) =>
    option({
      group: "session", label, about, checked: draft.session === value,
      choose: () => {
        draft.session = value;
        redraw();
      },
    }),
  );
  return section("Session", options);
}

/** Recent recordings, and the folders that can be browsed. @param {Tools} tools */
function drawOthers(tools) {
  const { choices, draft, redraw, forget } = tools;
  const recent = choices.recent.map(({ id, name, folder, opened_s, clicks }) =>
    option({
      group: "other", label: name, about: `${clicks} ${clicks === 1 ? "click" : "clicks"}, ${new Date(opened_s * 1000).toLocaleString()}, ${folder}`, checked: draft.recent === id,
      choose: () => {
        draft.recent = id;
        draft.paths.clear();
        redraw();
      },
    }),
  );
  const clear = make("button", "chip", "Clear the list");
  clear.onclick = forget;
  const none = make("p", "none", choices.name ? "No other recording was opened before." : "No recording was opened before.");
  const list = section("Recent recordings", recent.length ? [...recent, clear] : [none]);
  const hint = make("p", "none", "To choose from a folder here, start cocalib open with --root FOLDER.");
  const parts = [list, choices.root ? browser(tools) : hint];
  if (!choices.name) return make("div", "others", parts);
  const details = make("details", "others", [make("summary", "", "Another recording"), ...parts]);
  details.open = draft.recent !== "" || draft.paths.size > 0 || opened;
  details.ontoggle = () => (opened = details.open);
  return details;
}

/** Whether the other recordings are unfolded. */
let opened = false;

/** The folders below the root. @param {Tools} tools */
function browser({ choices, draft, folder, redraw, enter }) {
  if (!folder) return section(choices.root, [make("p", "none", "Reading the folder…")]);
  /** @param {string} path */
  const toggle = (path) => {
    draft.recent = "";
    if (!draft.paths.delete(path)) draft.paths.add(path);
    redraw();
  };
  /** @param {string} label @param {string} path */
  const way = (label, path) => {
    const button = make("button", "folder", label);
    button.onclick = () => enter(path);
    return button;
  };
  const up = folder.parent === null ? [] : [way("↑ one folder up", folder.parent)];
  const rows = folder.entries.flatMap(({ name, path, kind, size_bytes }) => {
    const row = option({ group: "path", kind: "checkbox", label: name, about: sizeWords(size_bytes), checked: draft.paths.has(path), choose: () => toggle(path) });
    if (kind === "recording") return [row];
    return kind === "folder" ? [way(`${name} /`, path)] : [row, way(`look into ${name} /`, path)];
  });
  const itself = folder.path === "" ? [] : [option({ group: "path", kind: "checkbox", label: "this folder itself", about: "images, radar files, data sets", checked: draft.paths.has(folder.path), choose: () => toggle(/** @type {NonNullable<typeof folder>} */ (folder).path) })];
  const note = folder.note ? [make("p", "none", folder.note)] : [];
  const chosen = draft.paths.size > 1 ? [make("p", "why", `${draft.paths.size} files are opened as one recording.`)] : [];
  return section(folder.path ? `${choices.root} / ${folder.path}` : choices.root, [...up, ...itself, ...rows, ...note, ...chosen]);
}

/** @param {number} bytes */
function sizeWords(bytes) {
  if (bytes >= 1e9) return `${(bytes / 1e9).toFixed(1)} GB`;
  return bytes >= 1e6 ? `${(bytes / 1e6).toFixed(1)} MB` : `${(bytes / 1e3).toFixed(1)} kB`;
}
