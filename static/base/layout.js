/** The shape of the page for the window's size, dividers, panes, the panel's pages and the theme; the user's choices are remembered. */

import { register } from "./actions.js";
import { emit, on } from "./state.js";

const root = document.documentElement;
const KEPT = "cocalib-layout";
/** Below this width [CSS px], or this height, there is room for the image and one pane. */
const NARROW = 900;
const LOW = 560;
/** Dividers are kept as parts of what they divide, so that they suit every window: the panel's of the width, the 3D view's of the
 * column, the image's of a narrow window's height.
 * @type {{right?: number, space?: number, split?: number, theme?: string, tab?: string, pane?: string}} */
let kept = {};

export function startLayout() {
  register(
    { id: "close-sheet", group: "Panel", words: "Close the sheet: go back to the tab before", also: "leave evaluate lens options", run: closeSheet },
    { id: "enlarge-panel", group: "Panel", words: "Enlarge the panel, or give the 3D view its place back", also: "tab plots large column", run: enlargePanel },
    { id: "theme", group: "Panel", words: "Light or dark theme", also: "colours colors bright night mode", run: toggleTheme },
  );
  try {
    kept = JSON.parse(localStorage.getItem(KEPT) ?? "{}");
  } catch {
    kept = {};
  }
  for (const name of /** @type {const} */ (["right", "space", "split"])) if (!(Number(kept[name]) < 1)) delete kept[name];
  applyDividers();
  setTheme(kept.theme === "light" ? "light" : "dark");
  showPage(tabs().some((tab) => nameOf(tab) === kept.tab) ? (kept.tab ?? "") : "mark");
  startPanes();
  addEventListener("resize", takeShape);
  takeShape();
  startDivider("divider-x", followX);
  startDivider("divider-y", followY);
  on(["box"], () => requestAnimationFrame(() => setTimeout(tellDividers))); // then the layout is done
  for (const bar of dividers()) for (const type of ["keyup", "pointerup", "focus"]) bar.addEventListener(type, tellDividers);
  for (const tab of tabs()) tab.onclick = () => showPage(nameOf(tab));
  element("menu").addEventListener("click", () => element("menu").hidePopover());
  element("menu").addEventListener("toggle", (event) => {
    const closed = /** @type {ToggleEvent} */ (event).newState === "closed";
    if (closed && document.activeElement === element("menu-button")) element("image-pane").focus({ preventScroll: true }); // the next key is for the image
  });
  document.getElementById("tabs")?.addEventListener("keydown", (event) => {
    const at = tabs().findIndex((tab) => tab === document.activeElement);
    const next = event.key === "ArrowRight" ? at + 1 : event.key === "ArrowLeft" ? at - 1 : -1;
    if (at < 0 || !tabs()[next]) return;
    showPage(nameOf(tabs()[next]));
    tabs()[next].focus();
  });
}

const tabs = () => /** @type {HTMLElement[]} */ ([...document.querySelectorAll("#tabs button")]);

/** @param {HTMLElement} part a tab or a page */
const nameOf = (part) => part.id.replace(/^(tab|page)-/, "");

/** Show a page of the panel: the one of a tab, or a sheet in the place of the tabs. @param {string} name */
export function showPage(name) {
  const isSheet = !tabs().some((tab) => nameOf(tab) === name);
  for (const page of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("#panel > .page"))) page.hidden = nameOf(page) !== name;
  for (const tab of tabs()) {
    tab.setAttribute("aria-selected", String(nameOf(tab) === name));
    tab.tabIndex = nameOf(tab) === name ? 0 : -1;
  }
  element("tabs").hidden = isSheet;
  element("sheet-title").hidden = element("sheet-close").hidden = !isSheet;
  element("sheet-title").textContent = isSheet ? element(`page-${name}`).getAttribute("aria-label") : "";
  if (!isSheet) keep({ tab: name });
  if (root.dataset.pane) showPane("panel");
  else emit("box");
}

/** Go back from a sheet to the tab before. */
export const closeSheet = () => showPage(kept.tab ?? "mark");

/** Give the panel the whole column, or the 3D view its place back. */
function enlargePanel() {
  document.body.classList.toggle("panel-large");
  emit("box");
}

/** @param {string} theme */
function setTheme(theme) {
  root.dataset.theme = theme;
  keep({ theme });
  emit("theme");
}

const toggleTheme = () => setTheme(root.dataset.theme === "light" ? "dark" : "light");

/** Choose the arrangement: "wide" has everything side by side, "low" the image and one pane, "tall" the image above one pane. */
function takeShape() {
  const wide = innerWidth >= NARROW && innerHeight >= LOW;
  root.dataset.shape = wide ? "wide" : innerHeight > innerWidth ? "tall" : "low";
  element("divider-x").setAttribute("aria-orientation", root.dataset.shape === "tall" ? "horizontal" : "vertical");
  element("divider-x").setAttribute("aria-label", root.dataset.shape === "tall" ? "Height of the image" : "Width of the image");
  emit("box");
}

function startPanes() {
  for (const button of paneButtons()) button.onclick = () => showPane(button.dataset.pane ?? "");
  showPane(paneButtons().some((button) => button.dataset.pane === kept.pane) ? (kept.pane ?? "") : "panel");
}

const paneButtons = () => /** @type {HTMLElement[]} */ ([...document.querySelectorAll("#panes button")]);

/** Show a pane beside the image where there is room for one only. @param {string} pane "image" for none */
function showPane(pane) {
  root.dataset.pane = pane;
  for (const button of paneButtons()) button.setAttribute("aria-pressed", String(button.dataset.pane === pane));
  keep({ pane });
  emit("box");
}

/** @param {string} id */
const element = (id) => /** @type {HTMLElement} */ (document.getElementById(id));

/** @param {number} value @param {number} low @param {number} high */
const clamp = (value, low, high) => Math.max(low, Math.min(high, value));

/** @param {typeof kept} change */
function keep(change) {
  Object.assign(kept, change);
  try {
    localStorage.setItem(KEPT, JSON.stringify(kept));
  } catch {
    // Without storage, the layout is just not remembered.
  }
}

/** The divider beside the image, or below it in a tall window. @param {{clientX: number, clientY: number}} event */
function followX(event) {
  const work = element("work").getBoundingClientRect();
  if (root.dataset.shape === "tall") keep({ split: clamp(event.clientY - 2 - work.top, 110, work.height - 120) / work.height });
  else keep({ right: clamp(innerWidth - event.clientX - 2, 260, innerWidth - 260) / innerWidth });
  applyDividers();
}

/** The divider between the 3D view and the panel. @param {{clientX: number, clientY: number}} event */
function followY(event) {
  const right = element("right").getBoundingClientRect();
  keep({ space: clamp(event.clientY - right.top, 120, right.height - 180) / right.height });
  applyDividers();
}

function applyDividers() {
  if (kept.right) root.style.setProperty("--right", `${100 * kept.right}vw`);
  if (kept.space) root.style.setProperty("--space", `${100 * kept.space}%`);
  if (kept.split) root.style.setProperty("--split", `${100 * kept.split}%`);
  tellDividers();
}

const dividers = () => /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll(".divider"));

/** Tell assistive technology where each divider is, as the share of the space before it [%]. */
function tellDividers() {
  for (const bar of dividers()) {
    const [box, around] = [bar.getBoundingClientRect(), bar.parentElement?.getBoundingClientRect()];
    if (!around) continue;
    const upright = bar.getAttribute("aria-orientation") === "vertical";
    const share = upright ? (box.left - around.left) / around.width : (box.top - around.top) / around.height;
    const values = { valuemin: 0, valuemax: 100, valuenow: Math.round(100 * Math.min(1, Math.max(0, share || 0))) };
    for (const [name, value] of Object.entries(values)) bar.setAttribute(`aria-${name}`, String(value));
  }
}

/** @param {string} id @param {(event: {clientX: number, clientY: number}) => void} follow */
function startDivider(id, follow) {
  const bar = element(id);
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
