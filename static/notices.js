// @ts-check
/** Notices: toasts for errors, the banner for a lost connection, and tooltips. */

const toasts = /** @type {HTMLElement} */ (document.getElementById("toasts"));
const banner = /** @type {HTMLElement} */ (document.getElementById("banner"));
const tip = /** @type {HTMLElement} */ (document.getElementById("tip"));
const TOAST_MS = 9000;
const TIP_MS = 280;
let tipTimer = 0;

/** Say what went wrong and what to do. @param {string} message @param {string} [hint] @param {string} [about] key by which `settled` removes it */
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
  setTimeout(() => box.remove(), TOAST_MS);
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

/** Show a tooltip on hover and on focus for every element with a data-hint. */
export function startTips() {
  document.addEventListener("pointerover", (event) => offer(event.target, event.clientX, event.clientY));
  document.addEventListener("focusin", (event) => {
    const target = /** @type {HTMLElement} */ (event.target);
    if (!target.matches?.(":focus-visible[data-hint]")) return;
    const box = target.getBoundingClientRect();
    offer(target, box.left, box.bottom);
  });
  document.addEventListener("pointerdown", hideTip);
  document.addEventListener("keydown", hideTip);
}

/** @param {EventTarget|null} target @param {number} x @param {number} y */
function offer(target, x, y) {
  const owner = target instanceof Element ? target.closest("[data-hint]") : null;
  clearTimeout(tipTimer);
  const hint = owner?.getAttribute("data-hint");
  if (!hint) {
    if (!(target instanceof HTMLCanvasElement)) tip.hidden = true;
    return;
  }
  tipTimer = window.setTimeout(() => showTip(hint, x, y + 14), TIP_MS);
}

/** Show a tooltip immediately. @param {string} text @param {number} x @param {number} y CSS px of the page; the tooltip appears below, or above near the bottom */
export function showTip(text, x, y) {
  tip.textContent = text;
  tip.hidden = false;
  const box = tip.getBoundingClientRect();
  tip.style.left = `${Math.max(6, Math.min(x + 8, innerWidth - box.width - 8))}px`;
  tip.style.top = `${y + box.height + 8 > innerHeight - 100 ? y - box.height - 18 : y + 6}px`;
}

export function hideTip() {
  clearTimeout(tipTimer);
  tip.hidden = true;
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

/** An icon from the sprite in index.html. @param {string} name */
export function icon(name) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  const use = document.createElementNS("http://www.w3.org/2000/svg", "use");
  use.setAttribute("href", `#i-${name}`);
  svg.setAttribute("aria-hidden", "true");
  svg.append(use);
  return svg;
}
