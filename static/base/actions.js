/** Every action of the page: what it does in words, its keys, and when it can be done. Whoever has one registers it; keys, help and palette ask here. */

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

/** In the order of the help. @type {Action[]} */
export const ACTIONS = [];

/** Add actions, after those that are there. @param {...Action} actions */
export const register = (...actions) => ACTIONS.push(...actions);

/** The action with a name. @param {string} id @returns {Action} */
export function actionNamed(id) {
  const found = ACTIONS.find((action) => action.id === id);
  if (!found) throw new Error(`no action ${id}`);
  return found;
}

/** Why an action cannot be done now; "" if it can. @param {Action} action */
export const reasonAgainst = (action) => action.when?.() ?? "";

/** Do it, unless it cannot be done now. @param {Action} action @returns {boolean} whether it was done */
export function act(action) {
  if (reasonAgainst(action)) return false;
  action.run();
  return true;
}

/** @type {Record<string, string>} */
const NAMES = { ...(/Mac|iP/.test(navigator.platform) ? { Ctrl: "⌘" } : {}), ArrowLeft: "←", ArrowRight: "→", ArrowUp: "↑", ArrowDown: "↓", Delete: "Del", Escape: "Esc", "-": "−" };

/** The names of the keys that are pressed together. @param {string} keys such as "Ctrl+Shift+Z" */
export const keyNames = (keys) => keys.split(/(?<=.)\+(?=.)/).map((key) => NAMES[key] ?? key);
