// @ts-check
/** Keyboard shortcuts; they also work while the 3D view has the focus. */

import { comeTo } from "./arriving.js";
import { fitEye, zoomEye } from "./birdseye.js";
import { flushNudge, nudgeBy, placeByKey, removeSelected, toggleExcluded, turnBack } from "./clicking.js";
import { openExport } from "./exporting.js";
import { toggleHelp } from "./help.js";
import { toggleLayer } from "./layers.js";
import { nextWorst } from "./pairs.js";
import { fit, zoomBy } from "./picture.js";
import { goTo, pause, play, step } from "./player.js";
import { toggleHidden, toggleLarge } from "./space.js";
import { isClicked, placementAt, state } from "./state.js";

/** Keys and what they do, in the order of the help dialog. @type {{keys: string[], does: string}[]} */
export const KEYS = [
  { keys: ["Space"], does: "play or pause" },
  { keys: ["←", "→"], does: "step one frame" },
  { keys: ["Shift", "←", "→"], does: "step ten frames" },
  { keys: ["N", "P"], does: "next or previous placement" },
  { keys: ["J"], does: "next worst pair" },
  { keys: ["Enter"], does: "place a mark where the reflector is expected, or in the middle" },
  { keys: ["Alt", "arrows"], does: "move the mark by 0.1 px" },
  { keys: ["Alt", "Shift", "arrows"], does: "move the mark by 1 px" },
  { keys: ["X"], does: "exclude the pair, or include it again" },
  { keys: ["Del"], does: "delete the click" },
  { keys: ["Ctrl", "Z"], does: "undo" },
  { keys: ["Ctrl", "Shift", "Z"], does: "redo" },
  { keys: ["F"], does: "fit the picture" },
  { keys: ["+", "−"], does: "zoom" },
  { keys: ["1", "–", "4"], does: "toggle overlays" },
  { keys: ["V"], does: "hide or show the 3D view" },
  { keys: ["B"], does: "enlarge the 3D view" },
  { keys: ["E"], does: "export" },
  { keys: ["?"], does: "this help" },
];

/** @type {Record<string, () => unknown>} */
const PLAIN = {
  " ": () => (state.playing ? pause() : play()),
  n: () => placement(1),
  p: () => placement(-1),
  j: nextWorst,
  x: toggleExcluded,
  f: fit,
  e: openExport,
  v: () => toggleHidden(),
  b: () => toggleLarge(),
  "+": () => zoomBy(1.25),
  "=": () => zoomBy(1.25),
  "-": () => zoomBy(0.8),
  "?": toggleHelp,
  1: () => toggleLayer("returns"),
  2: () => toggleLayer("others"),
  3: () => toggleLayer("ellipses"),
  4: () => toggleLayer("predictions"),
  Enter: placeByKey,
  Delete: removeSelected,
  Backspace: removeSelected,
  Home: () => goTo(0),
  End: () => goTo(state.seconds.length - 1),
};
/** The same for a recording without pictures. @type {Record<string, () => unknown>} */
const LOOKING = {
  " ": PLAIN[" "],
  n: PLAIN.n,
  p: PLAIN.p,
  f: fitEye,
  v: PLAIN.v,
  b: PLAIN.b,
  "+": () => zoomEye(1.25),
  "=": () => zoomEye(1.25),
  "-": () => zoomEye(0.8),
  "?": toggleHelp,
  Home: PLAIN.Home,
  End: PLAIN.End,
};
/** @type {Record<string, [number, number]>} */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/** Listen in a window, in the capture phase so as to run before viser's own handlers. @param {Window} owner */
export function listen(owner) {
  owner.addEventListener("keydown", pressed, { capture: true });
}

/** @param {KeyboardEvent} event */
function pressed(event) {
  const inside = event.view !== null && event.view !== window;
  const action = typing(event) && !inside ? undefined : actionOf(event);
  if (!action && !(inside && event.key in ARROWS)) return;
  event.preventDefault();
  event.stopImmediatePropagation();
  action?.();
}

/** Whether the key belongs to a field, a button or a dialog. @param {KeyboardEvent} event */
function typing(event) {
  const target = event.target;
  if (!(target instanceof HTMLElement)) return false;
  if (target.closest("dialog")) return event.key !== "?" || !target.closest("#help-dialog");
  if (target.matches("input:not([type=checkbox]), select, textarea")) return true;
  const presses = event.key === " " || event.key === "Enter";
  if (target.matches("button, a, summary, label, input") && presses) return !target.matches("#play");
  return target.closest("[role=tablist], .divider") !== null && event.key.startsWith("Arrow");
}

/** @param {KeyboardEvent} event @returns {(() => unknown)|undefined} */
function actionOf(event) {
  const command = event.ctrlKey || event.metaKey;
  if (command) return state.looking ? undefined : commandOf(event);
  if (event.key in ARROWS) return arrow(event);
  if (event.altKey) return undefined;
  return (state.looking ? LOOKING : PLAIN)[event.key.length === 1 ? event.key.toLowerCase() : event.key];
}

/** @param {KeyboardEvent} event */
function commandOf(event) {
  const key = event.key.toLowerCase();
  if (key === "z") return () => turnBack(event.shiftKey ? "redo" : "undo");
  return key === "y" ? () => turnBack("redo") : undefined;
}

/** @param {KeyboardEvent} event */
function arrow(event) {
  const [dx, dy] = ARROWS[event.key];
  const size = event.shiftKey ? 1 : 0.1;
  if (event.altKey) return () => nudgeBy(dx * size, dy * size);
  return dx ? () => step(dx * (event.shiftKey ? 10 : 1)) : undefined;
}

/** Go to the next placement, or the one before. @param {1|-1} direction */
export function placement(direction) {
  flushNudge();
  const done = placementAt(state.cursor);
  const frames = state.placements.filter((found) => found !== done || !isClicked(found)).map((found) => found.frame);
  const ahead = direction > 0 ? frames.filter((frame) => frame > state.cursor) : frames.filter((frame) => frame < state.cursor).reverse();
  const next = ahead.length ? ahead[0] : direction > 0 ? frames[0] : frames[frames.length - 1];
  if (next !== undefined) comeTo(next);
}
