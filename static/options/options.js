/** The options, built from the server's descriptions: the most used first, all others below. */

import { register, withImages } from "../base/actions.js";
import { showPage } from "../base/layout.js";
import { make, settled, toast } from "../base/notices.js";
import { send } from "../base/socket.js";
import { on, onPainted, state } from "../base/state.js";

/** @typedef {import("../messages.js").OptionDescription} Field */
const page = /** @type {HTMLElement} */ (document.getElementById("page-options"));
/** The most used options. */
const FIRST = [
  "locating.window_s", "noise.sigma_px", "gating.max_range_m", "solving.camera_position",
  "paper.region_m", "paper.ransac_threshold_px", "paper.window_s", "paper.max_range_m",
];
/** Options that a method ignores. @type {Record<string, (path: string) => boolean>} */
const IDLE = {
  default: (path) => /^(paper|mounting|board)\./.test(path),
  paper: (path) => /^(noise|solving|gating|radar|lens|reflector|refining|mounting|board)\./.test(path) || (path.startsWith("locating.") && path !== "locating.max_time_gap_s"),
};
/** Labels that are clearer than the option's own name. @type {Record<string, string>} */
const LABELS = {
  "locating.window_s": "Radar window around a click",
  "noise.sigma_px": "Click uncertainty",
  "gating.max_range_m": "Maximum range",
  "solving.camera_position": "Measured camera position",
  "paper.region_m": "Placement range",
  "paper.ransac_threshold_px": "RANSAC threshold",
  "paper.window_s": "Radar window around a click",
  "paper.max_range_m": "Maximum range",
  method: "Method",
  "radar.azimuth_scale_sigma": "Azimuth scale (0.02 = 2 %)",
  "radar.elevation_scale_sigma": "Elevation scale (0.03 = 3 %)",
  "radar.range_bias_sigma_m": "Range bias",
  "radar.elevation_lean_sigma": "Elevation lean",
  "radar.range_scale_sigma": "Range scale",
  "radar.azimuth_bias_sigma_deg": "Azimuth bias",
  "radar.elevation_bias_sigma_deg": "Elevation bias",
  "radar.tilt_sigma_deg": "Tilt, if it measures no elevation",
  "radar.height_sigma_m": "Height, if it measures no elevation",
  "lens.focal_length_sigma": "Focal length (0.003 = 0.3 %)",
  "lens.principal_point_sigma_px": "Principal point",
  "lens.distortion_sigma": "Distortion (k1)",
  "refining.intrinsics": "Refine the intrinsics with the pose",
  "refining.focal_length_sigma": "Focal length (0.03 = 3 %)",
  "refining.principal_point_sigma_px": "Principal point",
  "refining.distortion_sigma": "Distortion (k1)",
  "reflector.offset_sigma_m": "Clicked point to phase center",
  "reflector.click_offset_sigma_px": "Click offset",
  "solving.sensors_above_placements": "Sensors above the placements",
};
/** Other words by which someone may look for an option. @type {Record<string, string>} */
const ALSO = { "solving.camera_position": "tape measure ruler mounting", method: "paper algorithm 1 ransac" };
/** Headings that say more than the group's name. @type {Record<string, string>} */
const HEADINGS = {
  radar: "Radar: systematic errors, ± assumed",
  lens: "Lens: errors of the intrinsics, ±",
  refining: "Refining the intrinsics: how far off they may be, ±, if they come without a covariance",
  reflector: "Reflector: constant click offset, ±",
};
/** @type {Record<string, string>} */
const METHODS = { default: "Default", paper: "Paper" };
/** @type {Record<string, string>} */
const METHOD_HINTS = {
  default: "The default method: detects wrong pairs, models the noise of radar and clicks, reports the uncertainty of the pose.",
  paper: "Algorithm 1 of the paper, line by line: average, RANSAC, Levenberg-Marquardt. It weighs nothing, leaves no wrong pair out and states no error.",
};
/** @type {Map<string, (value: any) => void>} */
const writers = new Map();

/** Changes that the server has not confirmed: a View made before them would put the old values back. */
let sending = 0;

export function startOptions() {
  register({ id: "options", group: "Panel", words: "Options", also: "sheet settings parameters method", run: () => showPage("options"), when: withImages });
  on(["recording"], build);
  onPainted(["view"], () => void (sending || fill()));
}

function build() {
  const groups = state.recording?.option_groups ?? [];
  const fields = new Map(groups.flatMap((group) => group.options.map((field) => [field.path, field])));
  const box = make("div", "options", []);
  writers.clear();
  const method = fields.get("method");
  if (method) box.append(segmented(method));
  for (const path of FIRST) {
    const field = fields.get(path);
    if (field) box.append(control(field));
  }
  const more = make("details", "", [make("summary", "", "All options")]);
  const rest = make("div", "", []);
  for (const group of groups) {
    const others = group.options.filter((field) => !FIRST.includes(field.path) && field.path !== "method");
    if (!others.length) continue;
    const title = make("div", "group", HEADINGS[group.name] ?? sentence(group.name));
    title.dataset.hint = group.hint;
    rest.append(make("div", "part", [title, ...others.map(control)]));
  }
  more.append(rest);
  box.append(more);
  page.replaceChildren(box);
  fill();
}

/** @param {Field} field */
function segmented(field) {
  const buttons = field.choices.filter((choice) => METHODS[choice]).map((choice) => {
    const button = make("button", "", METHODS[choice]);
    button.dataset.method = choice;
    button.dataset.hint = METHOD_HINTS[choice] ?? field.hint;
    button.onclick = () => change(field.path, choice);
    return button;
  });
  writers.set(field.path, (value) => {
    for (const button of buttons) button.setAttribute("aria-pressed", String(button.dataset.method === value));
  });
  const group = make("span", "segmented", buttons);
  group.setAttribute("role", "group");
  group.setAttribute("aria-label", labelOf(field));
  return row(field, group);
}

/** @param {Field} field */
function control(field) {
  if (field.kind === "camera-position") return cameraPosition(field);
  if (field.kind === "choice") return choice(field);
  if (field.kind === "yes-no") return yesNo(field);
  const input = number(field.low, field.high);
  input.id = idOf(field);
  input.onchange = () => change(field.path, field.kind === "integer" ? Math.round(Number(input.value)) : Number(input.value));
  writers.set(field.path, (value) => write(input, value));
  return row(field, make("span", "control", [input, make("span", "unit", field.unit === "deg" ? "°" : field.unit)]));
}

/** @param {Field} field */
function choice(field) {
  const list = make("select", "", field.choices.map((name) => make("option", "", name)));
  list.id = idOf(field);
  list.onchange = () => change(field.path, list.value);
  writers.set(field.path, (value) => (list.value = value));
  return row(field, make("span", "control", [list]));
}

/** @param {Field} field */
function yesNo(field) {
  const input = make("input", "", []);
  input.type = "checkbox";
  input.id = idOf(field);
  input.onchange = () => change(field.path, input.checked);
  writers.set(field.path, (value) => (input.checked = value));
  return row(field, make("span", "control", [input]));
}

/** Measured camera position: what it is, and the buttons to enter it or take it back. @param {Field} field */
function cameraPosition(field) {
  const shown = make("span", "unit", "");
  const enter = make("button", "second", "Enter…");
  enter.id = idOf(field);
  enter.onclick = () => askPosition(field);
  const remove = make("button", "second", "Remove");
  remove.onclick = () => change(field.path, null);
  writers.set(field.path, (value) => {
    remove.hidden = value === null;
    shown.textContent = value === null ? "" : `${value.position_m.join(", ")} ± ${value.sigma_m} m`;
  });
  return row(field, make("span", "control", [shown, enter, remove]));
}

const positionDialog = make("dialog", "options position", []);
positionDialog.setAttribute("aria-label", "Camera position relative to the radar");
document.body.append(positionDialog);

/** Ask for the camera's position where the button is that has the focus: three distances, and how they were measured. @param {Field} field */
function askPosition(field) {
  const known = valueAt(/** @type {Record<string, any>} */ (state.view?.options), field.path);
  const names = ["forward", "left", "up"];
  const inputs = names.map((name, index) => {
    const input = number(-100, 100);
    input.required = true;
    input.dataset.hint = `Distance ${name} from the radar to the camera [m]`;
    input.value = String(known?.position_m[index] ?? "");
    return input;
  });
  const ways = Object.entries(field.measured);
  const how = make("select", "", [...ways.map(([words]) => words), "otherwise"].map((words) => make("option", "", words)));
  how.dataset.hint = "How the three distances were measured; this sets their standard deviation";
  const sigma = number(0.0001, 10);
  sigma.required = true;
  sigma.dataset.hint = "Standard deviation of each of the three distances [m]";
  sigma.value = String(known?.sigma_m ?? ways[0][1]);
  const shownWay = () => {
    const way = ways.findIndex(([, sigmaM]) => sigmaM === Number(sigma.value));
    how.selectedIndex = way < 0 ? ways.length : way;
  };
  how.onchange = () => void (ways[how.selectedIndex] && (sigma.value = String(ways[how.selectedIndex][1])));
  sigma.oninput = shownWay;
  shownWay();
  const use = make("button", "first", "Use it");
  const fields = [...inputs, sigma].map((input, index) => make("label", "", [make("span", "", `${names[index] ?? "±"} [m]`), input]));
  const form = make("form", "", [make("b", "", "Camera, seen from the radar"), make("div", "triple", fields), make("label", "how", ["measured", how]), use]);
  form.onsubmit = (event) => {
    event.preventDefault();
    positionDialog.close();
    change(field.path, { position_m: inputs.map((input) => Number(input.value)), sigma_m: Number(sigma.value) });
  };
  const button = document.activeElement === document.body ? document.getElementById("guide") : document.activeElement;
  const { left = 0, top = 0 } = button?.getBoundingClientRect() ?? {};
  positionDialog.replaceChildren(form);
  positionDialog.showModal();
  positionDialog.style.left = `${Math.max(8, Math.min(left, innerWidth - positionDialog.offsetWidth - 8))}px`;
  positionDialog.style.top = `${Math.max(8, Math.min(top, innerHeight - positionDialog.offsetHeight - 8))}px`;
  inputs[0].focus();
}

/** @param {number|null} low @param {number|null} high */
function number(low, high) {
  const input = make("input", "", []);
  input.type = "number";
  input.step = "any";
  if (low !== null) input.min = String(low);
  if (high !== null) input.max = String(high);
  return input;
}

/** Set the value of a field, unless it is being edited. @param {HTMLInputElement} input @param {any} value */
function write(input, value) {
  if (document.activeElement !== input) input.value = value === null || value === undefined ? "" : String(value);
}

/** @param {Field} field @param {HTMLElement} content */
function row(field, content) {
  const target = content.querySelector(`#${idOf(field)}`);
  const name = make(target ? "label" : "span", "name", labelOf(field));
  if (name instanceof HTMLLabelElement) name.htmlFor = idOf(field);
  const line = make("div", "field", [name, content]);
  line.dataset.hint = `${labelOf(field)}\n${field.hint}`;
  line.dataset.path = line.dataset.field = field.path;
  return line;
}

/** @param {string} path */
const fieldAt = (path) => state.recording?.option_groups.flatMap((group) => group.options).find((field) => field.path === path);

/** @param {Field} field */
const labelOf = (field) => LABELS[field.path] ?? sentence(field.label);

/** @param {Field} field */
const idOf = (field) => `option-${field.path.replaceAll(".", "-")}`;

/** @param {string} text */
const sentence = (text) => text.charAt(0).toUpperCase() + text.slice(1);

/** Fill the fields with the values of the view. */
function fill() {
  const options = /** @type {Record<string, any>|undefined} */ (state.view?.options);
  if (!options) return;
  showFieldsOf(options.method);
  for (const [path, set] of writers) {
    const value = valueAt(options, path);
    set(value);
    const field = fieldAt(path);
    const same = JSON.stringify(field?.default ?? null) === JSON.stringify(value ?? null);
    page.querySelector(`[data-path="${path}"]`)?.classList.toggle("changed", !same);
  }
}

/** Every option with its value, for the palette. A method ignores some. @returns {{path: string, label: string, value: string, reason: string, also: string}[]} */
export function optionRows() {
  const options = /** @type {Record<string, any>} */ (state.view?.options ?? {});
  return (state.recording?.option_groups ?? []).flatMap((group) => group.options).map((field) => {
    const value = valueAt(options, field.path) ?? "off";
    const reason = IDLE[options.method]?.(field.path) ? `Not used by the method "${METHODS[options.method] ?? options.method}"` : "";
    const shown = typeof value === "object" ? "given" : typeof value === "boolean" ? (value ? "yes" : "no") : `${value} ${field.unit}`.trim();
    return { path: field.path, label: labelOf(field), value: shown, reason, also: `option setting ${field.path.replaceAll(/[._]/g, " ")} ${field.label} ${ALSO[field.path] ?? ""}` };
  });
}

/** Show an option in the panel, ready to be changed. @param {string} path */
export function openOption(path) {
  const position = fieldAt(path);
  if (position?.kind === "camera-position") return askPosition(position);
  showPage("options");
  const line = /** @type {HTMLElement|null} */ (page.querySelector(`[data-field="${path}"]`));
  const folded = line?.closest("details");
  if (folded) folded.open = true;
  line?.scrollIntoView({ block: "center" });
  /** @type {HTMLElement|null|undefined} */ (line?.querySelector("input, select, button"))?.focus();
}

/** @param {string} path */
function optionLabel(path) {
  const field = fieldAt(path);
  return field ? labelOf(field) : "The option";
}

/** @param {Record<string, any>} options @param {string} path */
const valueAt = (options, path) => path.split(".").reduce((tree, name) => tree?.[name], /** @type {any} */ (options));

/** Show only the fields that a method uses. @param {string} method */
function showFieldsOf(method) {
  for (const line of /** @type {NodeListOf<HTMLElement>} */ (page.querySelectorAll("[data-field]"))) line.hidden = IDLE[method]?.(line.dataset.field ?? "") ?? false;
  for (const part of /** @type {NodeListOf<HTMLElement>} */ (page.querySelectorAll(".part"))) part.hidden = !part.querySelector("[data-field]:not([hidden])");
}

/** @param {string} path @param {any} value */
async function change(path, value) {
  if (typeof value === "number" && !Number.isFinite(value)) return fill();
  const [name, ...groups] = path.split(".").reverse();
  const options = groups.reduce((tree, group) => ({ [group]: tree }), /** @type {Record<string, any>} */ ({ [name]: value }));
  sending += 1;
  const refusal = await send({ type: "options_changed", options });
  sending -= 1;
  if (refusal) {
    toast(refusal, `${optionLabel(path)} keeps its previous value.`, path);
    /** @type {HTMLElement|null} */ (document.activeElement)?.blur();
  } else settled(path);
  if (!sending) fill();
}
