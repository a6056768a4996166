/**
 * Keyboard: which action a key runs, also while the 3D view has the focus; and one stop of the Tab key per table or row of figures, in
 * which the arrow keys go on.
 */

import { act, ACTIONS } from "../base/actions.js";
import { state } from "../base/state.js";
import { crossTakes } from "../image/cross.js";

/** Keys that stay with the page even where a field has the focus. */
const ANYWHERE = ["Ctrl+K"];
/** What a key that is held down does once. */
const ONCE = ["place-mark", "exclude", "next-candidate"];
/** Whether the pointer is down, and what it gave the focus to. @type {{isDown: boolean, target: EventTarget|null}} */
const pointed = { isDown: false, target: null };
/** The action of each combination of keys; made once all modules are loaded. @type {Map<string, import("../base/actions.js").Action>|null} */
let bound = null;

/** Listen in a window, in the capture phase so as to run before viser's own handlers. @param {Window} owner */
export function listen(owner) {
  owner.addEventListener("keydown", pressed, { capture: true });
  owner.addEventListener("pointerdown", () => (pointed.isDown = true), { capture: true });
  for (const end of ["pointerup", "pointercancel"]) owner.addEventListener(end, () => (pointed.isDown = false), { capture: true });
  owner.addEventListener("focusin", (event) => (pointed.target = pointed.isDown ? event.target : null), { capture: true });
}

/** @param {KeyboardEvent} event */
function pressed(event) {
  const inside = event.view !== null && event.view !== window;
  if (state.cross && !inside && !typing(event) && crossTakes(combination(event))) {
    event.preventDefault();
    return event.stopImmediatePropagation();
  }
  const action = typing(event) && !inside ? undefined : actionOf(event);
  if (!action && !(inside && event.key.startsWith("Arrow"))) return;
  event.preventDefault();
  event.stopImmediatePropagation();
  if (action && !(event.repeat && ONCE.includes(action.id))) act(action); // a key held down sets one mark
}

/** Whether the key belongs to a field, a button, a row or a dialog. @param {KeyboardEvent} event */
function typing(event) {
  const target = event.target;
  if (!(target instanceof HTMLElement)) return false;
  if (target.closest("dialog[open]")) return event.key !== "?" || !target.closest("#help-dialog");
  if (ANYWHERE.includes(combination(event))) return false;
  if (target.matches("input:not([type=checkbox]), select, textarea")) return true;
  const presses = event.key === " " || event.key === "Enter";
  if (target.matches(".plot")) return presses || event.key.startsWith("Arrow") || event.key === "Escape";
  if (target.matches("button, a, summary, label, input") && presses) return !target.matches("#play") && !(event.key === "Enter" && target === pointed.target);
  if (target.dataset.roves?.split(" ").includes(event.key)) return !event.altKey;
  return target.closest("[role=tablist], .divider") !== null && event.key.startsWith("Arrow");
}

/** The keys that are down, as actions.js writes them. A character other than a letter is what it is, with Shift or without. @param {KeyboardEvent} event */
function combination(event) {
  const key = event.key === " " ? "Space" : event.key.length === 1 ? event.key.toUpperCase() : event.key;
  const shifts = event.shiftKey && (key.length > 1 || /[A-Z]/.test(key));
  const held = [event.ctrlKey || event.metaKey ? "Ctrl" : "", event.altKey ? "Alt" : "", shifts ? "Shift" : ""];
  return [...held.filter(Boolean), key].join("+");
}

/** @param {KeyboardEvent} event */
function actionOf(event) {
  bound ??= new Map(ACTIONS.flatMap((action) => (action.keys ?? []).map((keys) => [keys, action])));
  const keys = combination(event);
  return bound.get(keys) ?? bound.get(keys.replace(/^Shift\+(?!Arrow)/, "")); // N with Shift, or with the capitals lock on
}

/**
 * A group of which one item can be reached by Tab.
 * @typedef {object} Group
 * @property {string} within Selector of the element that holds the items; it is always there.
 * @property {string} items
 * @property {"ArrowUp"|"ArrowLeft"} back
 * @property {"ArrowDown"|"ArrowRight"} on
 */
/** @type {Group[]} */
const GROUPS = [
  { within: "#page-mark", items: "tbody tr.row", back: "ArrowUp", on: "ArrowDown" },
  { within: "#figures", items: ".figure", back: "ArrowLeft", on: "ArrowRight" },
  { within: "#page-pose", items: "tr[data-hint]", back: "ArrowUp", on: "ArrowDown" },
];
const CONTROLS = "button, input, select, a[href]";

export function startRoving() {
  for (const group of GROUPS) rove(group);
}

/** @param {Group} group */
function rove(group) {
  const box = /** @type {HTMLElement} */ (document.querySelector(group.within));
  const items = () => /** @type {HTMLElement[]} */ ([...box.querySelectorAll(group.items)]);
  /** The item that had the focus last, and whether it still should: a row that is drawn again is another element. */
  let [last, held] = ["", false];
  const draw = () => {
    const all = items();
    const current = all.find((item) => nameOf(item) === last) ?? all.find((item) => item.getAttribute("aria-selected") === "true") ?? all[0];
    for (const item of all) offer(item, item === current, group);
    for (const table of box.querySelectorAll("table.pairs")) nameTable(table);
    if (held && current && nameOf(current) === last && document.activeElement === document.body) current.focus({ preventScroll: true });
  };
  new MutationObserver(draw).observe(box, { childList: true, subtree: true });
  box.addEventListener("focusin", (event) => {
    const item = /** @type {HTMLElement} */ (event.target).closest(group.items);
    held = item === event.target;
    if (!(item instanceof HTMLElement)) return;
    last = nameOf(item);
    draw();
  });
  box.addEventListener("focusout", (event) => {
    if (event.relatedTarget) held = false;
  });
  box.addEventListener("keydown", (event) => move(event, items(), group));
  draw();
}

/** @param {HTMLElement} item @param {boolean} isCurrent @param {Group} group */
function offer(item, isCurrent, group) {
  item.dataset.roves = `${group.back} ${group.on} Home End Enter`;
  item.tabIndex = isCurrent ? 0 : -1;
  for (const control of /** @type {NodeListOf<HTMLElement>} */ (item.querySelectorAll(CONTROLS))) control.tabIndex = isCurrent ? 0 : -1;
}

/** A table whose rows can be chosen is a grid. @param {Element} table */
function nameTable(table) {
  table.setAttribute("role", "grid");
  table.setAttribute("aria-label", table.matches(".placements") ? "Placements" : "Pairs");
}

/** @param {KeyboardEvent} event @param {HTMLElement[]} items @param {Group} group */
function move(event, items, group) {
  const target = /** @type {HTMLElement} */ (event.target);
  const at = items.indexOf(target);
  if (at < 0 || event.ctrlKey || event.altKey || event.metaKey || event.shiftKey) return;
  const last = items.length - 1;
  const next = { [group.back]: Math.max(0, at - 1), [group.on]: Math.min(last, at + 1), Home: 0, End: last }[event.key];
  if (event.key === "Enter") target.click();
  else if (next === undefined) return;
  else items[next].focus();
  event.preventDefault();
}

/** @param {HTMLElement} item */
const nameOf = (item) => item.dataset.id ?? item.dataset.placement ?? item.dataset.key ?? item.textContent ?? "";
