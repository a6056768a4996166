/** The list of the page Deliver: formats under the heading of where they are used, and a field to find one by typing. */

import { make } from "../base/notices.js";
import { fitOf } from "../base/searching.js";

/** FormatRow in app/cocalib/web/exports.py. @typedef {{key: string, label: string, group: string, also: string, takes_parent: boolean, takes_rectified: boolean}} Format */
/** How much of the best fit a format must reach to be shown: a name that is met exactly hides the similar ones. */
const NEARLY = 0.45;
const field = make("input", "", []);
const list = make("div", "found", []);
const none = make("div", "none", "");
/** @type {Format[]} */
let formats = [];
let chosen = "";
/** @type {(key: string) => void} */
let picked = () => {};

/** The column with the field and the list. @param {(key: string) => void} onPick Called with the key of the format that the user chooses. */
export function formatColumn(onPick) {
  picked = onPick;
  field.type = "text";
  field.className = "find";
  field.placeholder = "Find: ROS 2, nuScenes, matrix…";
  field.spellcheck = false;
  field.autocomplete = "off";
  const attributes = { role: "combobox", "aria-label": "Find a format", "aria-expanded": "true", "aria-controls": "export-found", "aria-autocomplete": "list" };
  for (const [name, value] of Object.entries(attributes)) field.setAttribute(name, value);
  list.id = "export-found";
  list.setAttribute("role", "listbox");
  list.setAttribute("aria-label", "Format");
  none.setAttribute("role", "status");
  field.addEventListener("input", draw);
  field.addEventListener("keydown", typing);
  list.addEventListener("keydown", walk);
  return make("div", "formats", [field, list, none]);
}

/** Show these formats. @param {Format[]} given @param {string} key of the one that is chosen */
export function drawFormats(given, key) {
  [formats, chosen] = [given, key];
  draw();
}

/** Show all formats again, to be searched. */
export function focusFormats() {
  field.value = "";
  draw();
  field.focus();
  options().find((one) => one.dataset.export === chosen)?.scrollIntoView({ block: "nearest" });
}

const options = () => /** @type {HTMLElement[]} */ ([...list.querySelectorAll("[data-export]")]);

/** The formats that fit what is typed. */
function found() {
  const query = field.value.trim();
  if (!query) return formats;
  const fits = formats.map((format) => fitOf(query, { words: `${format.label} ${format.key}`, also: format.also }));
  const least = Math.max(NEARLY * Math.max(...fits), Number.MIN_VALUE);
  return formats.filter((_, index) => fits[index] >= least);
}

function draw() {
  const shown = found();
  const groups = [...new Set(shown.map((format) => format.group))];
  list.replaceChildren(
    ...groups.map((name) => {
      const heading = make("div", "group", name);
      heading.setAttribute("aria-hidden", "true");
      const group = make("div", "", [heading, ...shown.filter((format) => format.group === name).map(option)]);
      group.setAttribute("role", "group");
      group.setAttribute("aria-label", name);
      return group;
    }),
  );
  list.hidden = shown.length === 0;
  none.textContent = shown.length ? "" : "No format fits. Try the name of a tool, such as Kalibr or Autoware.";
  mark();
}

/** @param {Format} format */
function option(format) {
  const item = make("button", "", [make("span", "", format.label), make("code", "", format.key)]);
  item.type = "button";
  item.id = `export-${format.key}`;
  item.setAttribute("role", "option");
  item.dataset.export = format.key;
  item.dataset.roves = "ArrowUp ArrowDown Home End";
  item.onclick = () => choose(format.key, true);
  return item;
}

/** Mark the chosen format; it, or else the first one, is where Tab goes. */
function mark() {
  const items = options();
  const current = items.find((item) => item.dataset.export === chosen);
  for (const item of items) {
    item.setAttribute("aria-selected", String(item === current));
    item.tabIndex = item === (current ?? items[0]) ? 0 : -1;
  }
  if (current) field.setAttribute("aria-activedescendant", current.id);
  else field.removeAttribute("aria-activedescendant");
}

/** @param {string} key @param {boolean} takesFocus */
function choose(key, takesFocus) {
  chosen = key;
  mark();
  const item = options().find((one) => one.dataset.export === key);
  if (takesFocus) item?.focus();
  item?.scrollIntoView({ block: "nearest" });
  picked(key);
}

/** The key of the format an arrow key leads to. @param {KeyboardEvent} event */
function target(event) {
  const items = options();
  const at = items.findIndex((item) => item.dataset.export === chosen);
  const down = at < 0 ? 0 : at + 1;
  const to = /** @type {Record<string, number>} */ ({ ArrowDown: down, ArrowUp: at - 1, Home: 0, End: items.length - 1 })[event.key];
  return to === undefined ? undefined : items[Math.max(0, Math.min(items.length - 1, to))]?.dataset.export;
}

/** In the list, arrows choose. @param {KeyboardEvent} event */
function walk(event) {
  const key = target(event);
  if (key === undefined) return;
  event.preventDefault();
  choose(key, true);
}

/** While typing, arrows choose, and Enter takes the first that fits. @param {KeyboardEvent} event */
function typing(event) {
  const items = options();
  if (event.key === "Escape") field.blur();
  else if (event.key === "Enter" && items.length) {
    event.preventDefault();
    const current = items.find((item) => item.dataset.export === chosen) ?? items[0];
    choose(String(current.dataset.export), true);
  } else if (event.key.startsWith("Arrow")) {
    const key = target(event);
    if (key === undefined) return;
    event.preventDefault();
    choose(key, false);
  }
}
