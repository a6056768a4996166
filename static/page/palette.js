/** The command palette: every action, placement, pair, frame and option, found by typing. */

import { act, ACTIONS, keyNames, reasonAgainst, register } from "../base/actions.js";
import { make } from "../base/notices.js";
import { fitOf } from "../base/searching.js";
import { clicks, isClicked, nameOf, residualText, select, state, stateOf, timeText } from "../base/state.js";
import { openOption, optionRows } from "../options/options.js";
import { comeTo } from "../image/arriving.js";
import { goTo, nearestIndex, pause } from "../time/player.js";

const KEPT = "cocalib-recent";
const MOST_RECENT = 6;
const MOST_ROWS = 90;
/** How much better a recent entry fits, in the scale of searching.js. */
const RECENT = 0.5;
const dialog = /** @type {HTMLDialogElement} */ (document.getElementById("palette"));
const field = make("input", "", []);
const list = make("div", "found", []);
const said = make("div", "none", "");
/** @type {Entry[]} */
let rows = [];
let chosen = 0;

export function startPalette() {
  register({ id: "palette", group: "Help", words: "Search for an action, placement, pair or option", keys: ["Ctrl+K"], also: "command palette find go to", run: () => togglePalette() });
  register({ id: "still-objects", group: "Time", words: "List what stood still and is hardly the reflector", also: "placements left out", run: () => togglePalette(STILL), when: () => (state.placements.some((one) => stateOf(one) === "unlikely") ? "" : "There is none") });
  field.type = "text";
  field.placeholder = "Action, option, placement 7, frame 120, time 12.5";
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

/** Finds what stood still and is hardly the reflector. */
const STILL = "still object";

/** Open the palette, or close it. @param {string} [query] to begin with */
function togglePalette(query = "") {
  if (dialog.open) return dialog.close();
  if (document.querySelector("dialog[open]")) return;
  field.value = query;
  dialog.showModal();
  window.focus(); // the 3D view may have had the focus
  field.focus();
  draw();
}

/** The actions as entries. @returns {Entry[]} */
const actions = () =>
  ACTIONS.map((action) => ({ id: action.id, group: action.group, words: action.words, also: `${action.also ?? ""} ${action.help ?? ""}`, keys: action.keys, reason: reasonAgainst(action), run: () => act(action) }));

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
    return fit ? [{ entry, fit: fit + (recent.includes(entry.id) ? RECENT : 0) }] : [];
  });
  ranked.sort((a, b) => b.fit - a.fit);
  return [...typedPlaces(query), ...ranked.map(({ entry }) => entry)];
}

/** What is said if nothing can be done: why not what fits best. @param {Entry|undefined} best */
const nothing = (best) => (best ? `${best.words}: ${best.reason}.` : "Nothing found. Try another word, such as zoom, outlier, color or save.");

function draw() {
  const all = found();
  rows = all.filter((entry) => !entry.reason).slice(0, MOST_ROWS);
  list.replaceChildren(...rows.map(line));
  list.hidden = rows.length === 0;
  said.textContent = rows.length ? "" : nothing(all[0]);
  chosen = -1;
  choose(rows.length ? 0 : -1);
}

/** @param {Entry} entry @param {number} index */
function line(entry, index) {
  const keys = (entry.keys ?? []).slice(0, 1).flatMap(keyNames).map((name) => make("kbd", "key", name));
  const box = make("div", "entry", [
    make("span", "words", [entry.words, make("small", "", entry.detail || "")]),
    make("span", "group", entry.group),
    make("span", "keys", keys),
  ]);
  box.id = `palette-${index}`;
  box.dataset.entry = entry.id;
  box.setAttribute("role", "option");
  box.setAttribute("aria-selected", "false");
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

/** Do what a row says. @param {number} index */
function run(index) {
  const entry = rows[index];
  if (!entry) return;
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

/**
 * A row of the palette.
 * @typedef {object} Entry
 * @property {string} id
 * @property {string} group
 * @property {string} words
 * @property {string} [detail] What it is now.
 * @property {string} [also]
 * @property {string[]} [keys]
 * @property {string} reason Why it cannot be done now, "" if it can.
 * @property {() => unknown} run
 */

/** Placements and pairs, and the options. @returns {Entry[]} */
const places = () => [...placements(), ...pairs(), ...options()];

/** @returns {Entry[]} */
function placements() {
  const count = state.placements.length;
  return state.placements.map((placement, index) => ({
    id: `placement:${index + 1}`,
    group: "Placement",
    words: `Placement ${index + 1}`,
    detail: `${timeText(state.seconds[placement.frame] ?? 0, 1)}, ${placement.range_m.toFixed(1)} m away${state.looking || isClicked(placement) ? "" : ", no click yet"}`,
    also: `of ${count} ${stateOf(placement) === "unlikely" ? STILL : "reflector"}`,
    reason: "",
    run: () => comeTo(placement.frame),
  }));
}

/** @returns {Entry[]} */
function pairs() {
  return clicks().filter((click) => click.id).map((click) => {
    const residual = click.residual_px === null ? click.state : `${residualText(click.residual_px)}${click.state === "inlier" ? "" : `, ${click.state}`}`;
    return {
      id: `pair:${click.id}`,
      group: "Pair",
      words: `Pair ${nameOf(click.id)}`,
      detail: [timeText(state.seconds[click.frame] ?? 0, 1), click.range_m === null ? "" : `${click.range_m.toFixed(1)} m`, residual].filter(Boolean).join(", "),
      also: `click mark ${click.state}`,
      reason: "",
      run: () => {
        comeTo(click.frame);
        select(click.id);
      },
    };
  });
}

/** @returns {Entry[]} */
function options() {
  if (state.looking) return [];
  return optionRows().map(({ path, label, value, reason, also }) => ({
    id: `option:${path}`, group: "Option", words: label, detail: value, also, reason, run: () => openOption(path),
  }));
}

/** A placement or pair that was typed but is not there. @param {string} query @returns {Entry[]} */
function missing(query) {
  const typed = /^(placement|pair)\s*(\d+)$/i.exec(query.trim());
  if (!typed) return [];
  const [isPair, number] = [typed[1].toLowerCase() === "pair", Number(typed[2])];
  const known = isPair ? clicks().some((click) => nameOf(click.id) === typed[2]) : number >= 1 && number <= state.placements.length;
  if (known) return [];
  const many = isPair ? clicks().length : state.placements.length;
  const reason = `There ${many === 1 ? "is 1" : `are ${many || "no"}`} ${isPair ? "pair" : "placement"}${many === 1 ? "" : "s"}`;
  return [{ id: "missing", group: isPair ? "Pair" : "Placement", words: `${isPair ? "Pair" : "Placement"} ${number}`, reason, run: () => {} }];
}

/** Frames and times that were typed: "frame 300", "time 12.5", "12.5 s", or only a number. @param {string} query @returns {Entry[]} */
function typedPlaces(query) {
  return [...missing(query), ...moments(query)];
}

/** @param {string} query @returns {Entry[]} */
function moments(query) {
  const typed = /^(?:(frame|f|time|t|at)\s*)?(\d+(?:[.,]\d+)?)\s*(s|sec|seconds)?$/i.exec(query.trim());
  if (!typed || !state.seconds.length) return [];
  const value = Number(typed[2].replace(",", "."));
  const isTime = /^(t|time|at)$/i.test(typed[1] ?? "") || typed[3] !== undefined;
  const isFrame = /^f/i.test(typed[1] ?? "");
  return [...(isTime || !Number.isInteger(value) ? [] : [frame(value)]), ...(isFrame ? [] : [time(value)])];
}

/** @param {number} number as shown below the clock, from 1 @returns {Entry} */
function frame(number) {
  const count = state.seconds.length;
  const seconds = state.seconds[number - 1];
  const reason = seconds === undefined ? `The recording has frames 1 to ${count}` : "";
  return { id: "frame", group: "Time", words: `Frame ${number}`, detail: seconds === undefined ? "" : timeText(seconds, 2), reason, run: () => go(number - 1) };
}

/** @param {number} seconds @returns {Entry} */
function time(seconds) {
  const last = state.seconds[state.seconds.length - 1];
  const index = nearestIndex(seconds);
  const reason = seconds > last ? `The recording ends at ${timeText(last, 1)}` : "";
  return { id: "time", group: "Time", words: `Time ${seconds} s`, detail: reason ? "" : `frame ${index + 1}`, reason, run: () => go(index) };
}

/** @param {number} index */
function go(index) {
  pause();
  goTo(index);
}
