/**
 * Fingers on the frame: one pans, a tap places or selects, a long press drags a cross under the loupe, two zoom and pan.
 * Only what fingers do is here; clicking.js has the mouse and the pen, and what a click is.
 */

import { make } from "../base/notices.js";
import { emit, on, select, state } from "../base/state.js";
import { leaveLive } from "../time/player.js";
import { markNear, moveTo, place } from "./clicking.js";
import { onImage, pan, toCss, toImage, viewport } from "./geometry.js";
import { hold } from "./loupe.js";
import { marks, redraw, zoomBy } from "./image.js";

/** A finger that moves farther than this no longer taps [CSS px]. */
const THRESHOLD = 9;
/** A finger this close to a mark means it [CSS px]. */
const REACH = 22;
/** A finger that rests this long takes the cross [ms]. */
const LONG_MS = 380;
/** A slow finger moves the cross by this part of its way, a fast one by all of it. */
const FINEST = 0.25;
/** Below and above these speeds of the finger [CSS px/ms]. */
const [SLOW, FAST] = [0.05, 0.4];
/** The loupe's lower edge stays this far above the finger [CSS px]. */
const ABOVE = 44;

const pane = /** @type {HTMLElement} */ (marks.parentElement);
const loupe = /** @type {HTMLCanvasElement} */ (document.getElementById("loupe"));
const cross = make("div", "", []);
/** Where each finger is [CSS px of the canvas]. @type {Map<number, {x: number, y: number}>} */
const fingers = new Map();
/** What the fingers do. @type {"idle"|"tap"|"pan"|"pinch"|"aim"} */
let doing = "idle";
let start = { x: 0, y: 0 };
let timer = 0;
/** What a long press drags: a mark, or a new cross; where it is [image px], and when it was moved last. @type {{mark: import("../messages.js").ClickRow|null, u: number, v: number, at: number}|null} */
let aim = null;

export function startTouch() {
  cross.id = "touch-cross";
  cross.hidden = true;
  pane.append(cross);
  // The pane is above the canvas: what is taken here never comes to the mouse's listeners.
  for (const [type, listener] of /** @type {[string, (event: PointerEvent) => void][]} */ ([["pointerdown", down], ["pointermove", move], ["pointerup", up], ["pointercancel", cancel], ["pointerleave", () => {}], ["contextmenu", () => {}]])) {
    pane.addEventListener(type, (event) => take(/** @type {PointerEvent} */ (event), listener), { capture: true });
  }
  on(["cursor", "playing"], stopAiming);
}

/** @param {PointerEvent} event @param {(event: PointerEvent) => void} listener */
function take(event, listener) {
  if (event.pointerType !== "touch" || event.target !== marks) return;
  event.preventDefault();
  event.stopPropagation();
  listener(event);
}

/** @param {PointerEvent} event */
function inBox(event) {
  const box = marks.getBoundingClientRect();
  return { x: event.clientX - box.left, y: event.clientY - box.top };
}

/** @param {PointerEvent} event */
function down(event) {
  if (!state.shown || fingers.size === 2) return;
  leaveLive();
  marks.setPointerCapture(event.pointerId);
  fingers.set(event.pointerId, inBox(event));
  clearTimeout(timer);
  if (fingers.size === 2) {
    stopAiming();
    doing = "pinch";
    return;
  }
  pane.focus({ preventScroll: true });
  start = inBox(event);
  doing = "tap";
  if (!state.playing) timer = window.setTimeout(startAiming, LONG_MS);
}

/** @param {PointerEvent} event */
function move(event) {
  const before = fingers.get(event.pointerId);
  if (!before) return;
  const now = inBox(event);
  if (doing === "pinch") pinch(event.pointerId, before, now);
  fingers.set(event.pointerId, now);
  if (doing === "aim") moveAim(now.x - before.x, now.y - before.y, event.timeStamp);
  if (doing === "tap" && Math.hypot(now.x - start.x, now.y - start.y) >= THRESHOLD) {
    clearTimeout(timer);
    doing = "pan";
  }
  if (doing !== "pan") return;
  pan(now.x - before.x, now.y - before.y);
  redraw();
  emit("box");
}

/**
 * Keep what is under two fingers under them: zoom about the one that rests, and pan by what remains, half for each.
 * @param {number} id of the finger that moved @param {{x: number, y: number}} before @param {{x: number, y: number}} now
 */
function pinch(id, before, now) {
  const rests = [...fingers].find(([key]) => key !== id)?.[1];
  if (!rests) return;
  const apart = (/** @type {{x: number, y: number}} */ finger) => Math.max(8, Math.hypot(finger.x - rests.x, finger.y - rests.y));
  const factor = apart(now) / apart(before);
  zoomBy(factor, rests.x, rests.y);
  pan((now.x - rests.x - factor * (before.x - rests.x)) / 2, (now.y - rests.y - factor * (before.y - rests.y)) / 2);
}

/** @param {PointerEvent} event */
function up(event) {
  clearTimeout(timer);
  if (!fingers.delete(event.pointerId)) return;
  const done = doing;
  doing = fingers.size ? "pan" : "idle"; // after a pinch, the finger that stays pans
  if (done === "tap") tap();
  else if (done === "aim") drop();
}

/** @param {PointerEvent} event */
function cancel(event) {
  clearTimeout(timer);
  fingers.delete(event.pointerId);
  if (!fingers.size) doing = "idle";
  stopAiming();
}

function tap() {
  const mark = markNear(start.x, start.y, REACH);
  if (mark) return select(mark.id);
  const [u, v] = toImage(start.x, start.y);
  if (onImage(u, v)) place(u, v);
}

/** Take the mark under the finger, or a new cross. */
function startAiming() {
  if (doing !== "tap" || state.playing) return;
  const mark = markNear(start.x, start.y, REACH);
  const [u, v] = mark ? [mark.u_px, mark.v_px] : toImage(start.x, start.y);
  if (!onImage(u, v)) return;
  doing = "aim";
  aim = { mark, u, v, at: performance.now() };
  navigator.vibrate?.(12);
  showAim();
}

/** Move the cross with the finger, the more finely the slower it moves. @param {number} dx @param {number} dy CSS px @param {number} at [ms] */
function moveAim(dx, dy, at) {
  if (!aim) return;
  const speed = Math.hypot(dx, dy) / Math.max(1, at - aim.at);
  const gain = FINEST + (1 - FINEST) * Math.min(1, Math.max(0, (speed - SLOW) / (FAST - SLOW)));
  const [x, y] = toCss(aim.u, aim.v);
  const [u, v] = toImage(x + dx * gain, y + dy * gain);
  const inside = (/** @type {number} */ value, /** @type {number} */ size) => Math.min(size - 0.5, Math.max(-0.5, value));
  aim = { ...aim, u: inside(u, viewport.imageWidth), v: inside(v, viewport.imageHeight), at };
  showAim();
}

/** Draw the cross where it stands, and the loupe above the finger, or below it where there is no room. */
function showAim() {
  if (!aim) return;
  const finger = fingers.values().next().value ?? start;
  const [x, y] = toCss(aim.u, aim.v);
  cross.hidden = false;
  cross.style.transform = `translate(${x}px, ${y}px)`;
  loupe.classList.add("by-finger");
  hold({ u: aim.u, v: aim.v });
  const side = loupe.offsetWidth;
  const above = finger.y - ABOVE - side;
  loupe.style.setProperty("--loupe-x", `${Math.max(4, Math.min(viewport.width - side - 4, finger.x - side / 2))}px`);
  loupe.style.setProperty("--loupe-y", `${above >= 0 ? above : Math.max(0, Math.min(viewport.height - side, finger.y + ABOVE))}px`);
}

/** Set the mark where the cross stands. */
function drop() {
  const { mark, u, v } = aim ?? { mark: null, u: NaN, v: NaN };
  stopAiming();
  if (Number.isNaN(u)) return;
  if (mark) moveTo(mark, u, v);
  else place(u, v);
}

function stopAiming() {
  clearTimeout(timer);
  if (!aim) return;
  aim = null;
  if (doing === "aim") doing = "pan";
  cross.hidden = true;
  loupe.classList.remove("by-finger");
  hold(null);
}
