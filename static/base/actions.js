/** Every action of the page: what it does in words, its keys, and when it can be done. Each room registers its own; keys, help and palette ask here. */

import { state } from "./state.js";

/**
 * @typedef {object} Action
 * @property {string} id
 * @property {string} group Heading in the help.
 * @property {string} words What it does, in the imperative.
 * @property {string[]} [keys] Keys that run it, such as "Ctrl+Shift+Z"; the first one is shown.
 * @property {string} [help] The line of the help, where neighbouring actions share one.
 * @property {string} [also] Other words by which someone may look for it.
 * @property {() => unknown} run
 * @property {() => string} [when] Why it cannot be done now, "" if it can; without it, it can be done at any time.
 */

/** The headings of the help, from the top. */
const GROUPS = ["Time", "Mark", "Pairs", "Image", "3D view", "Panel", "File", "Help"];

/** In the order of the help. @type {Action[]} */
export const ACTIONS = [];

/** What is tried first, by the action's id. @type {Map<string, {attempt: () => boolean, takes: () => boolean}>} */
const attempts = new Map();

/** Add actions, after those of their group that are there. @param {...Action} actions */
export function register(...actions) {
  ACTIONS.push(...actions);
  ACTIONS.sort((one, other) => GROUPS.indexOf(one.group) - GROUPS.indexOf(other.group));
}

/**
 * Let a room do another room's action in its own way where it can.
 * @param {string} id
 * @param {() => boolean} attempt does it; false leaves it to the other room
 * @param {() => boolean} [takes] whether it would, also where something stands against the action otherwise
 */
export const attemptFirst = (id, attempt, takes = () => false) => attempts.set(id, { attempt, takes });

/** The action with a name. @param {string} id @returns {Action} */
export function actionNamed(id) {
  const found = ACTIONS.find((action) => action.id === id);
  if (!found) throw new Error(`no action ${id}`);
  return found;
}

/** Why an action cannot be done now; "" if it can. @param {Action} action */
export const reasonAgainst = (action) => (attempts.get(action.id)?.takes() ? "" : (action.when?.() ?? ""));

/** Do it, unless it cannot be done now. @param {Action} action @returns {boolean} whether it was done */
export function act(action) {
  if (reasonAgainst(action)) return false;
  if (!attempts.get(action.id)?.attempt()) action.run();
  return true;
}

/** Why nothing can be done yet; "" once the recording is open. */
export const opened = () => (state.recording ? "" : "The recording is not open yet");

/** Why nothing can be done in images; "" if it can. */
export const withImages = () => opened() || (state.looking ? "There are no images in this recording" : "");

/** @type {Record<string, string>} */
const NAMES = { ...(/Mac|iP/.test(navigator.platform) ? { Ctrl: "⌘" } : {}), ArrowLeft: "←", ArrowRight: "→", ArrowUp: "↑", ArrowDown: "↓", Delete: "Del", Escape: "Esc", "-": "−" };

/** The names of the keys that are pressed together. @param {string} keys such as "Ctrl+Shift+Z" */
export const keyNames = (keys) => keys.split(/(?<=.)\+(?=.)/).map((key) => NAMES[key] ?? key);
