/** Keyboard: which action of actions.js a key runs. It also works while the 3D view has the focus. */

import { ACTIONS, act } from "./actions.js";
import { comeTo } from "./arriving.js";
import { flushNudge } from "./clicking.js";
import { crossTakes } from "./cross.js";
import { shownOffer } from "./proposals.js";
import { clicksOf, isDismissed, isOffered, placementAt, state } from "./state.js";

/** Keys that stay with the page even where a field has the focus. */
const ANYWHERE = ["Ctrl+K"];
/** What a key that is held down does once. */
const ONCE = ["place-mark", "exclude", "next-candidate"];
/** Whether the pointer is down, and what it gave the focus to. @type {{isDown: boolean, target: EventTarget|null}} */
const pointed = { isDown: false, target: null };
/** The action of each combination of keys; made once all modules are loaded. @type {Map<string, import("./actions.js").Action>|null} */
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
  if (target.matches("button, a, summary, label, input") && presses) return !target.matches("#play") && !(event.key === "Enter" && target === pointed.target && shownOffer());
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

/** Go to the next placement that wants a click, or to any other once all have one; or to the one before. @param {1|-1} direction */
export function placement(direction) {
  flushNudge();
  const here = placementAt(state.cursor);
  const stay = state.placements.filter((found) => !isDismissed(found) && clicksOf(found).every((click) => click.state !== "excluded"));
  const open = stay.filter(isOffered);
  const wanted = direction > 0 && open.length ? open : stay.filter((found) => found !== here);
  const frames = [...new Set(wanted.map((found) => found.frame))].sort((a, b) => a - b);
  const ahead = direction > 0 ? frames.filter((frame) => frame > state.cursor) : frames.filter((frame) => frame < state.cursor).reverse();
  const next = ahead.length ? ahead[0] : direction > 0 ? frames[0] : frames[frames.length - 1];
  if (next !== undefined) comeTo(next, true);
}
