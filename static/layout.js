// @ts-check
/** Dividers, tabs and the theme; the user's choices are remembered. */

import { emit, on, state } from "./state.js";

const root = document.documentElement;
const KEPT = "cocalib-layout";
/** @type {{right?: number, space?: number, theme?: string, tab?: string}} */
let kept = {};

export function startLayout() {
  try {
    kept = JSON.parse(localStorage.getItem(KEPT) ?? "{}");
  } catch {
    kept = {};
  }
  if (kept.right) root.style.setProperty("--right", `${kept.right}px`);
  if (kept.space) root.style.setProperty("--space", `${kept.space}px`);
  setTheme(kept.theme === "light" ? "light" : "dark");
  divider("divider-x", (event) => keep({ right: clamp(innerWidth - event.clientX - 2, 300, innerWidth - 340) }));
  divider("divider-y", (event) => {
    const top = /** @type {HTMLElement} */ (document.getElementById("right")).getBoundingClientRect();
    keep({ space: clamp(event.clientY - top.top, 120, top.height - 180) });
  });
  const theme = /** @type {HTMLElement} */ (document.getElementById("theme"));
  theme.onclick = () => {
    kept.theme = root.dataset.theme === "light" ? "dark" : "light";
    setTheme(kept.theme);
    keep({});
  };
  for (const tab of tabs()) tab.onclick = () => showTab(tab.id);
  document.getElementById("tabs")?.addEventListener("keydown", (event) => {
    const at = tabs().findIndex((tab) => tab === document.activeElement);
    const next = event.key === "ArrowRight" ? at + 1 : event.key === "ArrowLeft" ? at - 1 : -1;
    if (at < 0 || !tabs()[next]) return;
    showTab(tabs()[next].id);
    tabs()[next].focus();
  });
  showTab(kept.tab && document.getElementById(kept.tab) ? kept.tab : "tab-pairs");
}

const tabs = () => /** @type {HTMLElement[]} */ ([...document.querySelectorAll("#tabs button")]);

/** @param {string} id */
export function showTab(id) {
  for (const tab of tabs()) {
    const chosen = tab.id === id;
    tab.setAttribute("aria-selected", String(chosen));
    tab.tabIndex = chosen ? 0 : -1;
    const page = document.getElementById(tab.getAttribute("aria-controls") ?? "");
    if (page) page.hidden = !chosen;
  }
  keep({ tab: id });
  emit("box");
}

/** @param {string} theme */
function setTheme(theme) {
  root.dataset.theme = theme;
  emit("theme");
}

/** @param {number} value @param {number} low @param {number} high */
const clamp = (value, low, high) => Math.round(Math.max(low, Math.min(high, value)));

/** @param {typeof kept} change */
function keep(change) {
  Object.assign(kept, change);
  if (change.right) root.style.setProperty("--right", `${change.right}px`);
  if (change.space) root.style.setProperty("--space", `${change.space}px`);
  try {
    localStorage.setItem(KEPT, JSON.stringify(kept));
  } catch {
    // Without storage, the layout is just not remembered.
  }
}

/** @param {string} id @param {(event: {clientX: number, clientY: number}) => void} follow */
function divider(id, follow) {
  const bar = /** @type {HTMLElement} */ (document.getElementById(id));
  bar.addEventListener("pointerdown", (event) => {
    bar.setPointerCapture(event.pointerId);
    bar.classList.add("dragging");
    document.body.classList.add("dragging-divider");
  });
  bar.addEventListener("pointermove", (event) => {
    if (bar.classList.contains("dragging")) follow(event);
  });
  const stop = () => {
    bar.classList.remove("dragging");
    document.body.classList.remove("dragging-divider");
  };
  bar.addEventListener("pointerup", stop);
  bar.addEventListener("pointercancel", stop);
  bar.addEventListener("keydown", (event) => {
    const [dx, dy] = /** @type {Record<string, [number, number]>} */ ({ ArrowLeft: [-16, 0], ArrowRight: [16, 0], ArrowUp: [0, -16], ArrowDown: [0, 16] })[event.key] ?? [0, 0];
    if (!dx && !dy) return;
    const box = bar.getBoundingClientRect();
    follow({ clientX: box.left + 2 + dx, clientY: box.top + 2 + dy });
    event.preventDefault();
  });
}

/** Highlight the Pose tab once there is a calibration. */
export function startBadges() {
  on(["view"], () => document.getElementById("tab-pose")?.classList.toggle("ready", state.view?.has_calibration ?? false));
}
