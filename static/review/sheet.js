/**
 * The contact sheet of the page Check: a cut-out of every mark with its reprojection, the longest residual first. Arrows walk through it,
 * Enter goes to the mark, X leaves it out or takes it in again, R says that it was looked at.
 */

import { ask, content } from "../base/asking.js";
import { make, shape, toast } from "../base/notices.js";
import { send } from "../base/socket.js";
import { nameOf, residualText, stampOf, state } from "../base/state.js";

/** @typedef {import("./review.js").Row} Row */
/** Side of a cut-out [px of the image], doubled until it is so many times as long as the residual. */
const [SIDE, MOST, WIDER] = [96, 768, 2.4];
const KEYS = "ArrowLeft ArrowRight ArrowUp ArrowDown Home End Enter x X r R";

/** @type {Map<string, HTMLButtonElement>} */
const cells = new Map();
/** @type {(id: string) => void} */
let arrive = () => {};
const sheet = make("div", "sheet", []);
/** So many are asked for at a time. */
const BATCH = 12;
/** The arrows of cells that were never near the part in sight. @type {WeakMap<Element, () => Element>} */
const arrows = new WeakMap();
const observer = new IntersectionObserver(complete, { root: document.getElementById("page-check"), rootMargin: "60px 0px" });

/** @param {(id: string) => void} go Goes to a click. */
export function contactSheet(go) {
  arrive = go;
  sheet.setAttribute("role", "group");
  sheet.setAttribute("aria-label", "All marks, the longest residual first");
  sheet.addEventListener("keydown", pressed);
  sheet.addEventListener("focusin", (event) => rove(/** @type {HTMLElement} */ (event.target)));
  return sheet;
}

/** Draw the marks in this order; cut-outs that are there stay. @param {Row[]} rows @param {Set<string>} marked @param {import("./plots.js").Highlight} highlight */
export function drawSheet(rows, marked, highlight) {
  const reviewed = new Set(state.view?.reviewed ?? []);
  const known = new Set(rows.map((row) => row.click.id));
  for (const id of [...cells.keys()]) if (!known.has(id)) cells.delete(id);
  /** @type {HTMLElement[]} */
  const first = [];
  const shown = rows.map((row, index) => {
    const { id } = row.click;
    const cell = cells.get(id) ?? make("button", "", []);
    cells.set(id, cell);
    if (fill(cell, row, reviewed.has(id))) index < BATCH ? first.push(cell) : observer.observe(cell);
    cell.classList.toggle("marked", marked.has(id));
    mark(cell, highlight);
    return cell;
  });
  if (first.length) getCutOuts(first); // the server makes them while the browser lays out the others
  if (shown.length !== sheet.children.length || shown.some((cell, index) => cell !== sheet.children[index])) {
    const held = sheet.contains(document.activeElement) ? /** @type {HTMLElement} */ (document.activeElement) : null;
    sheet.replaceChildren(...shown);
    held?.focus({ preventScroll: true });
  }
  rove(shown.find((cell) => cell.tabIndex === 0) ?? shown[0]);
}

/** Show what is hovered, brushed and selected. @param {import("./plots.js").Highlight} highlight */
export function markSheet(highlight) {
  for (const cell of cells.values()) mark(cell, highlight);
}

/** Go on to the next of these that nobody has looked at; the first that is left, after the last. @param {Set<string>} ids @returns {boolean} whether there is one */
export function nextUnreviewed(ids) {
  const all = items();
  const from = all.indexOf(/** @type {HTMLElement} */ (document.activeElement)) + 1;
  const next = [...all.slice(from), ...all.slice(0, from)].find((cell) => ids.has(String(cell.dataset.id)) && !cell.matches(".reviewed, .excluded"));
  next?.focus();
  return next !== undefined;
}

const items = () => /** @type {HTMLElement[]} */ ([...sheet.children]);

/** @param {HTMLElement} cell @param {import("./plots.js").Highlight} highlight */
function mark(cell, { hovered, brushed, selected }) {
  const id = String(cell.dataset.id);
  cell.classList.toggle("hovered", hovered.has(id) || brushed.has(id));
  cell.setAttribute("aria-current", String(selected === id));
}

/** @param {HTMLButtonElement} cell @param {Row} row @param {boolean} isReviewed @returns {boolean} whether it needs a cut-out */
function fill(cell, { click, kind, right, down, length }, isReviewed) {
  const side = Math.min(MOST, SIDE * 2 ** Math.max(0, Math.ceil(Math.log2((WIDER * length) / SIDE))));
  const { sec, nanosec } = stampOf(click.frame);
  const source = `${sec}${String(nanosec).padStart(9, "0")},${click.u_px.toFixed(2)},${click.v_px.toFixed(2)},${side}`;
  const words = `${nameOf(click.id)}: ${residualText(length)}${kind === "agreeing" ? "" : `, ${kind}`}${isReviewed ? ", reviewed" : ""}`;
  const drawn = `${source} ${right.toFixed(1)} ${down.toFixed(1)} ${words}`;
  if (cell.dataset.drawn === drawn) return false;
  cell.className = `crop ${kind}${isReviewed ? " reviewed" : ""}`;
  Object.assign(cell.dataset, { id: click.id, drawn, source, roves: KEYS });
  cell.setAttribute("aria-label", words);
  cell.onclick = () => arrive(click.id);
  const image = cell.querySelector("img");
  cell.replaceChildren(...(image ? [image, arrow(side, right, down)] : []), make("span", "", [make("b", "", nameOf(click.id)), ` ${residualText(length)}${isReviewed ? " ✓" : ""}`]));
  if (image?.dataset.source === source) return false;
  arrows.set(cell, () => arrow(side, right, down));
  return true;
}

/** Get the cut-outs that are near the part in sight. @param {IntersectionObserverEntry[]} entries */
function complete(entries) {
  const near = entries.filter((entry) => entry.isIntersecting).map((entry) => /** @type {HTMLElement} */ (entry.target));
  for (const cell of near) observer.unobserve(cell);
  for (let first = 0; first < near.length; first += BATCH) getCutOuts(near.slice(first, first + BATCH));
}

/** @param {HTMLElement[]} of */
async function getCutOuts(of) {
  const sources = of.map((cell) => String(cell.dataset.source));
  const images = of.map((cell, index) => {
    const image = cell.querySelector("img") ?? Object.assign(make("img", "", []), { width: SIDE, height: SIDE, alt: "" });
    if (!image.parentElement) cell.prepend(image, .../** @type {Element[]} */ ([arrows.get(cell)?.()].filter(Boolean)));
    image.dataset.source = sources[index];
    return image;
  });
  const { answer } = await ask(`api/crops.json?${sources.join(";")}`);
  /** @type {(string|null)[]} */
  const made = (answer && (await content(answer.json()))) ?? [];
  for (const [index, image] of images.entries()) if (made[index] && image.dataset.source === sources[index]) image.src = `data:image/jpeg;base64,${made[index]}`;
}

/** From the mark to its reprojection. @param {number} side @param {number} right @param {number} down px of the image */
function arrow(side, right, down) {
  const drawn = shape("svg", { viewBox: `${-side / 2} ${-side / 2} ${side} ${side}`, "aria-hidden": "true" });
  const ring = 0.05 * side;
  for (const name of ["rim", "residual"]) drawn.append(shape("path", { class: name, d: `M0 0L${right} ${down}M${right + ring} ${down}a${ring} ${ring} 0 1 0 ${-2 * ring} 0a${ring} ${ring} 0 1 0 ${2 * ring} 0` }));
  return drawn;
}

/** One cut-out can be reached by Tab. @param {HTMLElement|undefined} current */
function rove(current) {
  const cell = current?.closest(".crop");
  if (!cell) return;
  for (const item of items()) item.tabIndex = item === cell ? 0 : -1;
}

/** @param {KeyboardEvent} event */
function pressed(event) {
  const [all, cell] = [items(), /** @type {HTMLElement} */ (event.target).closest(".crop")];
  if (!(cell instanceof HTMLElement) || event.ctrlKey || event.metaKey || event.altKey) return;
  const [at, id] = [all.indexOf(cell), String(cell.dataset.id)];
  const columns = all.filter((item) => item.offsetTop === all[0].offsetTop).length;
  const to = /** @type {Record<string, number>} */ ({ ArrowLeft: at - 1, ArrowRight: at + 1, ArrowUp: at - columns, ArrowDown: at + columns, Home: 0, End: all.length - 1 })[event.key];
  if (to !== undefined) all[Math.max(0, Math.min(all.length - 1, to))].focus();
  else if (/^x$/i.test(event.key)) say({ type: "click_excluded", id, excluded: !cell.classList.contains("excluded") });
  else if (/^r$/i.test(event.key)) say({ type: "marks_reviewed", ids: [id], reviewed: !cell.classList.contains("reviewed") });
  else return;
  event.preventDefault();
}

/** @param {Record<string, any>} step */
async function say(step) {
  const refusal = await send(step);
  if (refusal) toast(refusal);
}
