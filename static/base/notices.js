/** Notices: toasts for errors, the banner for a lost connection, and explanations of figures and controls. */

import { on } from "./state.js";

const toasts = /** @type {HTMLElement} */ (document.getElementById("toasts"));
const banner = /** @type {HTMLElement} */ (document.getElementById("banner"));
const tip = /** @type {HTMLElement} */ (document.getElementById("tip"));
const main = /** @type {HTMLElement} */ (document.getElementById("work"));
const TOAST_MS = 9000;
const TIP_MS = 280;
/** Room between an explanation and what it explains [CSS px]. */
const TIP_GAP = 6;
let tipTimer = 0;
/** What the explanation on screen belongs to. @type {HTMLElement|null} */
let explained = null;

/** Say what went wrong and what to do. @param {string} message @param {string} [hint] @param {string} [about] key by which `settled` removes it, and path of the option that it is about */
export function toast(message, hint = "", about = "") {
  const text = toasts.querySelector(".toast span")?.textContent;
  if (text === message) return;
  const box = make("div", "toast", [make("span", "", message), hint ? make("small", "", hint) : ""]);
  box.dataset.about = about;
  const close = make("button", "", "×");
  close.setAttribute("aria-label", "Close");
  close.onclick = () => box.remove();
  box.append(close);
  toasts.append(box);
  while (toasts.children.length > 3) toasts.firstElementChild?.remove();
  placeToasts();
  setTimeout(() => box.remove(), TOAST_MS);
}

/** Corners of the page for the toasts, the preferred one first. */
const CORNERS = ["bottom-right", "top-right", "bottom-left", "top-left"];

/** Put the toasts where they cover neither the field being edited nor the mark; into the dialog, if one is open. */
function placeToasts() {
  if (!toasts.childElementCount) return;
  const home = document.querySelector("dialog[open]") ?? document.body;
  if (toasts.parentElement !== home) home.append(toasts);
  const clear = keptClear();
  toasts.dataset.corner = CORNERS[0];
  for (const corner of CORNERS) {
    toasts.dataset.corner = corner;
    const box = toasts.getBoundingClientRect();
    if (!clear.some((other) => other.left < box.right && box.left < other.right && other.top < box.bottom && box.top < other.bottom)) return;
  }
  toasts.dataset.corner = CORNERS[0];
}

/** @typedef {{left: number, top: number, right: number, bottom: number}} Place */
/** @type {(() => Place|null)[]} */
const places = [];

/** Let no toast cover a place of the page. @param {() => Place|null} place where it is now, if anywhere */
export const keepClear = (place) => places.push(place);

/** What no toast may cover. @returns {Place[]} */
function keptClear() {
  const about = [...toasts.children].map((box) => /** @type {HTMLElement} */ (box).dataset.about).filter(Boolean);
  const fields = about.map((path) => document.querySelector(`[data-field="${path}"]`));
  const edited = document.activeElement?.matches("input, select, textarea") ? document.activeElement : null;
  const boxes = [...fields, edited].flatMap((element) => (element ? [element.getBoundingClientRect()] : []));
  return [...boxes, ...places.flatMap((place) => place() ?? [])];
}

/** Remove the toasts about something that has been corrected. @param {string} about */
export function settled(about) {
  for (const box of /** @type {NodeListOf<HTMLElement>} */ (toasts.querySelectorAll(".toast"))) if (box.dataset.about === about) box.remove();
}

/** @param {string} text "" hides it */
export function setBanner(text) {
  banner.hidden = text === "";
  banner.textContent = text;
}

/** Show the explanation of every element with a data-hint, on hover and on focus by keyboard; Escape puts it away. */
export function startTips() {
  document.addEventListener("pointerover", (event) => offer(event.target, event.clientX));
  document.addEventListener("focusin", (event) => {
    placeToasts();
    const target = /** @type {HTMLElement} */ (event.target);
    if (target.matches(":focus-visible")) offer(target, target.getBoundingClientRect().left);
  });
  document.addEventListener("focusout", hideTip);
  document.addEventListener("pointerdown", hideTip);
  document.addEventListener("keydown", hideTip, { capture: true });
  document.addEventListener("close", bringBack, { capture: true });
  addEventListener("resize", placeToasts);
  on(["shown", "view", "box"], placeToasts);
}

/** Bring the notices back from a dialog that was closed. */
function bringBack() {
  if (tip.closest("dialog")) main.append(tip);
  if (toasts.closest("dialog")) document.body.append(toasts);
}

/** @param {EventTarget|null} target @param {number} x CSS px where it is pointed at */
function offer(target, x) {
  const owner = target instanceof Element ? target.closest("[data-hint]") : null;
  clearTimeout(tipTimer);
  if (!(owner instanceof HTMLElement) || !owner.dataset.hint) return hideTip();
  tipTimer = window.setTimeout(() => explain(owner, x), TIP_MS);
}

/** Show the explanation of an element below it, or above where there is no room, of a row beside the table: it covers neither the element nor the next rows. @param {HTMLElement} owner @param {number} x */
function explain(owner, x) {
  if (!owner.isConnected) return;
  hideTip();
  (owner.closest("dialog") ?? main).append(tip);
  tip.textContent = owner.dataset.hint ?? "";
  tip.hidden = false;
  const [box, around] = [tip.getBoundingClientRect(), owner.getBoundingClientRect()];
  const below = around.bottom + TIP_GAP + box.height <= innerHeight;
  const beside = owner.closest(".pairs tbody") !== null && around.left > box.width + 6;
  tip.style.left = `${beside ? around.left - box.width - TIP_GAP : Math.max(6, Math.min(x + 8, innerWidth - box.width - 8))}px`;
  tip.style.top = beside ? `${Math.min(around.top, innerHeight - box.height - TIP_GAP)}px` : `${below ? around.bottom + TIP_GAP : Math.max(0, around.top - TIP_GAP - box.height)}px`;
  if (owner.hasAttribute("aria-describedby")) return;
  owner.setAttribute("aria-describedby", tip.id);
  explained = owner;
}

/** Show words at a point of a canvas immediately. @param {string} text @param {number} x @param {number} y CSS px of the page; they appear below, or above near the bottom */
export function showTip(text, x, y) {
  hideTip();
  main.append(tip);
  tip.textContent = text;
  tip.hidden = false;
  const box = tip.getBoundingClientRect();
  tip.style.left = `${Math.max(6, Math.min(x + 8, innerWidth - box.width - 8))}px`;
  tip.style.top = `${y + box.height + 8 > innerHeight - 100 ? y - box.height - 18 : y + 6}px`;
}

export function hideTip() {
  clearTimeout(tipTimer);
  tip.hidden = true;
  explained?.removeAttribute("aria-describedby");
  explained = null;
}

/**
 * Create an element. Text is inserted as text: whatever a recording contains, it is never parsed as HTML.
 * @template {keyof HTMLElementTagNameMap} T
 * @param {T} name @param {string} className @param {string|(Node|string)[]} content @returns {HTMLElementTagNameMap[T]}
 */
export function make(name, className, content) {
  const element = document.createElement(name);
  if (className) element.className = className;
  element.append(...(typeof content === "string" ? [content] : content));
  return element;
}

/** An element of a drawing. @param {string} name @param {Record<string, string|number>} attributes @param {Element[]} [parts] */
export function shape(name, attributes, parts = []) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, String(value));
  element.append(...parts);
  return element;
}

/** An icon from the sprite in index.html. @param {string} name */
export const icon = (name) => shape("svg", { "aria-hidden": "true" }, [shape("use", { href: `#i-${name}` })]);
