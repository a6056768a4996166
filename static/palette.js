/** The command palette: every action, placement, pair and option, found by typing. */

import { ACTIONS, keyNames, reasonAgainst } from "./actions.js";
import { make } from "./notices.js";
import { places, typedPlaces } from "./places.js";
import { fitOf } from "./searching.js";

/** @typedef {import("./places.js").Entry} Entry */
const KEPT = "cocalib-recent";
const MOST_RECENT = 6;
const MOST_ROWS = 90;
/** How much better a recent entry fits, in the scale of searching.js. */
const RECENT = 0.5;
/** How much worse one fits that cannot be done now. */
const DISABLED = 1;
const dialog = /** @type {HTMLDialogElement} */ (document.getElementById("palette"));
const field = make("input", "", []);
const list = make("div", "found", []);
const said = make("div", "none", "");
/** @type {Entry[]} */
let rows = [];
let chosen = 0;

export function startPalette() {
  field.type = "text";
  field.placeholder = "Search for an action or an option, or type placement 7, pair c3, frame 120, time 12.5";
  field.spellcheck = false;
  field.autocomplete = "off";
  const attributes = { role: "combobox", "aria-label": "Search for an action, a placement, a pair or an option", "aria-expanded": "true", "aria-controls": "palette-found", "aria-autocomplete": "list" };
  for (const [name, value] of Object.entries(attributes)) field.setAttribute(name, value);
  list.id = "palette-found";
  list.setAttribute("role", "listbox");
  list.setAttribute("aria-label", "What was found");
  said.setAttribute("role", "status");
  dialog.append(field, list, said);
  field.addEventListener("input", () => draw());
  dialog.addEventListener("keydown", pressed);
  dialog.addEventListener("click", clicked);
  list.addEventListener("pointermove", (event) => choose(indexOf(event.target)));
}

/** Open the palette, or close it. */
export function togglePalette() {
  if (dialog.open) return dialog.close();
  if (document.querySelector("dialog[open]")) return;
  field.value = "";
  dialog.showModal();
  window.focus(); // the 3D view may have had the focus
  field.focus();
  draw();
}

/** The actions as entries. @returns {Entry[]} */
const actions = () =>
  ACTIONS.map((action) => ({ id: action.id, group: action.group, words: action.words, also: `${action.also ?? ""} ${action.help ?? ""}`, keys: action.keys, reason: reasonAgainst(action), run: action.run }));

/** The entries for what is typed: the recent ones first as long as nothing is. @returns {Entry[]} */
function found() {
  const recent = recalled();
  const query = field.value.trim();
  if (!query) {
    const known = new Map([...actions(), ...places()].map((entry) => [entry.id, entry]));
    const first = recent.flatMap((id) => known.get(id) ?? []).map((entry) => ({ ...entry, group: "Recent" }));
    return [...first, ...actions().filter((entry) => !recent.includes(entry.id))];
  }
  const ranked = [...actions(), ...places()].flatMap((entry) => {
    const fit = fitOf(query, entry);
    return fit ? [{ entry, fit: fit + (recent.includes(entry.id) ? RECENT : 0) - (entry.reason ? DISABLED : 0) }] : [];
  });
  ranked.sort((a, b) => b.fit - a.fit);
  return [...typedPlaces(query), ...ranked.map(({ entry }) => entry)];
}

function draw() {
  rows = found();
  const shown = rows.slice(0, MOST_ROWS);
  list.replaceChildren(...shown.map(line));
  list.hidden = rows.length === 0;
  said.textContent = rows.length ? "" : "Nothing found. Try another word, such as zoom, outlier, colour or save.";
  rows = shown;
  chosen = -1;
  choose(rows.length ? 0 : -1);
}

/** @param {Entry} entry @param {number} index */
function line(entry, index) {
  const keys = (entry.keys ?? []).slice(0, 1).flatMap(keyNames).map((name) => make("kbd", "key", name));
  const box = make("div", "entry", [
    make("span", "words", [entry.words, make("small", "", entry.reason || entry.detail || "")]),
    make("span", "group", entry.group),
    make("span", "keys", keys),
  ]);
  box.id = `palette-${index}`;
  box.dataset.entry = entry.id;
  box.setAttribute("role", "option");
  box.setAttribute("aria-selected", "false");
  box.setAttribute("aria-disabled", String(entry.reason !== ""));
  return box;
}

/** @param {number} index */
function choose(index) {
  if (index === chosen || index < -1) return;
  list.children[chosen]?.setAttribute("aria-selected", "false");
  chosen = index;
  const box = list.children[chosen];
  box?.setAttribute("aria-selected", "true");
  box?.scrollIntoView({ block: "nearest" });
  if (box) field.setAttribute("aria-activedescendant", box.id);
  else field.removeAttribute("aria-activedescendant");
}

/** The row that contains an element; -2 if none does. @param {EventTarget|null} target */
function indexOf(target) {
  const box = target instanceof Element ? target.closest(".entry") : null;
  return box ? [...list.children].indexOf(box) : -2;
}

/** @param {KeyboardEvent} event */
function pressed(event) {
  const page = 8;
  const steps = /** @type {Record<string, number>} */ ({ ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page });
  const isToggle = event.key.toLowerCase() === "k" && (event.ctrlKey || event.metaKey);
  if (event.key in steps && rows.length) {
    const next = chosen + steps[event.key];
    const wraps = Math.abs(steps[event.key]) === 1;
    choose(wraps ? (next + rows.length) % rows.length : Math.min(rows.length - 1, Math.max(0, next)));
  } else if (event.key === "Enter") run(chosen);
  else if (isToggle) dialog.close();
  else if (event.key === "Tab") choose(chosen); // there is nothing else to go to
  else return;
  event.preventDefault();
}

/** @param {MouseEvent} event */
function clicked(event) {
  if (event.target === dialog) return dialog.close();
  run(indexOf(event.target));
}

/** Do what a row says; one that cannot be done stays, with its reason. @param {number} index */
function run(index) {
  const entry = rows[index];
  if (!entry || entry.reason) return;
  dialog.close();
  remember(entry.id);
  entry.run();
}

/** @returns {string[]} */
function recalled() {
  try {
    const ids = JSON.parse(localStorage.getItem(KEPT) ?? "[]");
    return Array.isArray(ids) ? ids : [];
  } catch {
    return [];
  }
}

/** @param {string} id */
function remember(id) {
  if (id === "palette") return;
  try {
    localStorage.setItem(KEPT, JSON.stringify([id, ...recalled().filter((other) => other !== id)].slice(0, MOST_RECENT)));
  } catch {
    // Without storage, the order is just not remembered.
  }
}
