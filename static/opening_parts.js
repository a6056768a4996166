/** The parts of the dialog that chooses what is opened: radar and camera, intrinsics, session, other recordings. */

import { make } from "./notices.js";

/** @typedef {import("./messages.js").OpeningChoices} Choices */
/** @typedef {{choices: Choices, draft: import("./opening.js").Draft, folder: import("./messages.js").FolderListing|null, redraw: () => void, give: (file: File) => void, choose: () => void, enter: (path: string) => void, forget: () => void}} Tools */

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

/** The radars or the cameras of the recording. @param {Tools} tools @param {"radar"|"image"} which */
export function drawTopics({ choices, draft, redraw }, which) {
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
export function drawIntrinsics({ choices, draft, redraw, give }) {
  const input = make("input", "", "");
  input.type = "file";
  input.hidden = true;
  input.onchange = () => input.files?.[0] && give(input.files[0]);
  const pick = make("button", "drop", draft.file ? `${draft.file.name}: drop or choose another file` : "Drop a camera file anywhere, or choose one… (camera_info YAML, OpenCV YAML or XML, Kalibr, JSON)");
  pick.onclick = () => input.click();
  /** @type {[import("./opening.js").Draft["intrinsics"], string, string, boolean][]} */
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
export function drawSession({ choices, draft, redraw }) {
  const { folder, clicks, recording, continues } = choices.session;
  if (!folder) return make("span", "", "");
  const held = `${clicks} ${clicks === 1 ? "click" : "clicks"}`;
  /** @type {[import("./opening.js").Draft["session"], string, string][]} */
  const rows = [
    ["continue", "Continue where the frames are the same", continues ? `${held}, ${folder}` : `if that in ${folder} is of these frames; another one is left alone`],
    ["new", "Start a new session", "the one there is kept under another name"],
    ["copy", "Start a new session with the clicks that fit", `${held} of ${recording || folder}: those whose frames this recording has`],
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
export function drawOthers(tools) {
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
  const itself = folder.path === "" ? [] : [option({ group: "path", kind: "checkbox", label: "this folder itself", about: "pictures, radar files, data sets", checked: draft.paths.has(folder.path), choose: () => toggle(/** @type {NonNullable<typeof folder>} */ (folder).path) })];
  const note = folder.note ? [make("p", "none", folder.note)] : [];
  const chosen = draft.paths.size > 1 ? [make("p", "why", `${draft.paths.size} files are opened as one recording.`)] : [];
  return section(folder.path ? `${choices.root} / ${folder.path}` : choices.root, [...up, ...itself, ...rows, ...note, ...chosen]);
}

/** @param {number} bytes */
function sizeWords(bytes) {
  if (bytes >= 1e9) return `${(bytes / 1e9).toFixed(1)} GB`;
  return bytes >= 1e6 ? `${(bytes / 1e6).toFixed(1)} MB` : `${(bytes / 1e3).toFixed(1)} kB`;
}
