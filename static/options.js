// @ts-check
/** The options, drawn from the server's own description of them: the few that matter first, all others below. */

import { make, settled, toast } from "./notices.js";
import { send } from "./socket.js";
import { on, state } from "./state.js";

/** @typedef {import("./messages.js").OptionDescription} Field */
const page = /** @type {HTMLElement} */ (document.getElementById("page-options"));
/** The options that most people come for. */
const FIRST = [
  "locating.window_s", "noise.sigma_px", "gating.max_range_m", "solving.camera_position",
  "paper.ransac_threshold_px", "paper.window_s", "paper.max_range_m",
];
/** What a method does not look at. @type {Record<string, (path: string) => boolean>} */
const IDLE = {
  default: (path) => path.startsWith("paper."),
  paper: (path) => /^(noise|solving|gating)\./.test(path) || (path.startsWith("locating.") && path !== "locating.max_time_gap_s"),
};
/** Names that say more than the option's own. @type {Record<string, string>} */
const LABELS = {
  "locating.window_s": "Radar window around a click",
  "noise.sigma_px": "Uncertainty of a click",
  "gating.max_range_m": "Farthest return",
  "solving.camera_position": "Camera position by tape",
  "paper.ransac_threshold_px": "RANSAC threshold",
  "paper.window_s": "Radar window around a click",
  "paper.max_range_m": "Farthest return",
  method: "Method",
};
/** @type {Record<string, string>} */
const METHODS = { default: "Default", paper: "Paper" };
/** @type {Record<string, string>} */
const METHOD_HINTS = {
  default: "The default method: robust, finds wrong pairs, weighs radar and click noise, says how sure it is.",
  paper: "Algorithm 1 of the paper, line by line: average, RANSAC, Levenberg-Marquardt.",
};
/** @type {Map<string, (value: any) => void>} */
const writers = new Map();

export function startOptions() {
  on(["recording"], build);
  on(["view"], fill);
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
    const title = make("div", "group", group.name);
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
  const buttons = field.choices.map((choice) => {
    const button = make("button", "", METHODS[choice] ?? choice);
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
  return row(field, make("span", "control", [input, make("span", "unit", field.unit)]));
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

/** Camera position by tape measure: off, or three numbers and how sure they are. @param {Field} field */
function cameraPosition(field) {
  const wanted = make("input", "", []);
  wanted.type = "checkbox";
  wanted.id = idOf(field);
  const names = ["forward", "left", "up"];
  const inputs = names.map(() => number(-100, 100));
  inputs.forEach((input, index) => {
    input.dataset.hint = `Camera's distance ${names[index]} of the radar [m]`;
  });
  const sure = number(0.0001, 10);
  sure.dataset.hint = "Standard deviation of each of the three distances [m]";
  const named = [...inputs, sure].map((input, index) => make("label", "", [make("span", "", names[index] ?? "± sigma"), input]));
  const numbers = make("span", "control triple", [...named, make("span", "unit", "m")]);
  numbers.setAttribute("role", "group");
  numbers.setAttribute("aria-label", "Camera seen from the radar");
  const told = () => {
    const entered = [...inputs, sure].every((input) => input.value !== "");
    if (entered) change(field.path, { position_m: inputs.map((input) => Number(input.value)), sigma_m: Number(sure.value) });
  };
  wanted.onchange = () => {
    numbers.hidden = !wanted.checked;
    if (!wanted.checked) return change(field.path, null);
    if (sure.value === "") sure.value = "0.01";
    inputs[0].focus();
    told();
  };
  for (const input of [...inputs, sure]) input.onchange = told;
  writers.set(field.path, (value) => {
    const entered = inputs.every((input) => input.value !== "");
    if (value === null && wanted.checked && (!entered || numbers.contains(document.activeElement))) return; // the tape is being read
    wanted.checked = value !== null;
    numbers.hidden = value === null;
    if (value === null) return; // what was entered waits until it is wanted again
    inputs.forEach((input, index) => write(input, value.position_m[index]));
    write(sure, value.sigma_m);
  });
  const head = row(field, make("span", "control", [wanted]));
  const box = make("div", "position", [head, numbers]);
  box.dataset.field = field.path;
  return box;
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

/** A field that is being typed in keeps its text. @param {HTMLInputElement} input @param {any} value */
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

/** @param {Field} field */
const labelOf = (field) => LABELS[field.path] ?? sentence(field.label);

/** @param {Field} field */
const idOf = (field) => `option-${field.path.replaceAll(".", "-")}`;

/** @param {string} text */
const sentence = (text) => text.charAt(0).toUpperCase() + text.slice(1);

/** Put the values of the view into the fields. */
function fill() {
  const options = /** @type {Record<string, any>|undefined} */ (state.view?.options);
  if (!options) return;
  showFieldsOf(options.method);
  for (const [path, set] of writers) {
    const value = path.split(".").reduce((tree, name) => tree?.[name], /** @type {any} */ (options));
    set(value);
    const field = state.recording?.option_groups.flatMap((group) => group.options).find((other) => other.path === path);
    const same = JSON.stringify(field?.default ?? null) === JSON.stringify(value ?? null);
    page.querySelector(`[data-path="${path}"]`)?.classList.toggle("changed", !same);
  }
}

/** Show the fields that count for a method. @param {string} method */
function showFieldsOf(method) {
  for (const line of /** @type {NodeListOf<HTMLElement>} */ (page.querySelectorAll("[data-field]"))) line.hidden = IDLE[method]?.(line.dataset.field ?? "") ?? false;
  for (const part of /** @type {NodeListOf<HTMLElement>} */ (page.querySelectorAll(".part"))) part.hidden = !part.querySelector("[data-field]:not([hidden])");
}

/** Words of the server with the option's label in place of its name. @param {string} words */
function inLabels(words) {
  const fields = (state.recording?.option_groups ?? []).flatMap((group) => group.options).filter((field) => field.path.includes("."));
  return fields.reduce((text, field) => text.replace(new RegExp(`(option )?\\b${field.path.replaceAll(".", "\\.")}(\\.\\w+)?\\b`, "g"), labelOf(field)), words);
}

/** @param {string} path @param {any} value */
async function change(path, value) {
  if (typeof value === "number" && !Number.isFinite(value)) return fill();
  const [name, ...groups] = path.split(".").reverse();
  const options = groups.reduce((tree, group) => ({ [group]: tree }), /** @type {Record<string, any>} */ ({ [name]: value }));
  const refusal = await send({ type: "options_changed", options });
  if (!refusal) return settled(path);
  toast(inLabels(refusal), "The option is back at its last value.", path);
  /** @type {HTMLElement|null} */ (document.activeElement)?.blur();
  fill();
}
