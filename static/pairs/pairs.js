/** The table of pairs, one row per click, sorted by time, range or residual; click a row to go there, its checkbox to exclude it. */

import { register, withImages } from "../base/actions.js";
import { LARGE_PX, residualColour } from "../base/colours.js";
import { showPage } from "../base/layout.js";
import { make, shape } from "../base/notices.js";
import { clickIn, clicks, digits, nameOf, onPainted, residualText, select, stampKey, state, timeText } from "../base/state.js";
import { withSelected } from "../image/actions.js";
import { comeTo } from "../image/arriving.js";
import { candidatesOf, choose } from "../image/candidates.js";
import { toggleExcluded } from "../image/clicking.js";
import { dismissHere, withoutPlacement } from "../image/dismissing.js";

/** @typedef {import("../messages.js").ClickRow} Click */
/** So many candidates are listed; the others are less probable. */
const MOST_CHOICES = 6;
const page = /** @type {HTMLElement} */ (document.getElementById("page-mark"));
const count = /** @type {HTMLElement} */ (document.getElementById("pair-count"));
/** @type {{key: "frame"|"residual_px"|"range_m", descending: boolean}} */
const sorting = { key: "frame", descending: false };
/** @type {{key: "frame"|"residual_px"|"range_m"|null, label: string, hint: string}[]} */
const COLUMNS = [
  { key: null, label: "Place", hint: "Number of the placement, as in the timeline." },
  { key: "frame", label: "Time", hint: "Time since the first frame. Click to sort." },
  { key: "range_m", label: "Range", hint: "Distance from the radar to the reflector. Click to sort." },
  { key: "residual_px", label: "Residual", hint: "Distance between the click and the reprojection of its radar position. Click to sort." },
  { key: null, label: "Use", hint: "" },
];
const body = make("tbody", "", []);
const head = make("thead", "", []);
const table = make("table", "pairs", [head, body]);
const withResiduals = () => withImages() || (clicks().some((click) => click.residual_px !== null) ? "" : "There is no calibration yet");
/** The table's row of each click, and what it was drawn from: a row is made again only when that changes. @type {Map<string, {from: unknown[], row: HTMLElement}>} */
const made = new Map();
/** The click whose row was scrolled to last. @type {string|null} */
let shownRow = null;
/** What else was drawn: the head of the table, or what to click. */
let drawn = "";

export function startPairs() {
  register(
    { id: "mark", group: "Panel", words: "Mark: the pairs and the returns that each may use", also: "tab table list clicks placements candidates", run: () => showPage("mark") },
    { id: "worst", group: "Pairs", words: "Next worst pair", keys: ["J"], also: "outlier residual largest wrong bad", run: nextWorst, when: withResiduals },
    { id: "exclude", group: "Pairs", words: "Exclude or include the pair; without a mark, dismiss the placement", keys: ["X"], also: "leave out use ignore disable spurious", run: () => (clickIn(state.cursor) ? toggleExcluded() : dismissHere()), when: () => withImages() || (clickIn(state.cursor) ? withSelected() : withoutPlacement()) },
  );
  onPainted(["opening", "view", "selected", "recording", "placements", "candidates", "proposals"], draw);
  page.addEventListener("click", pressed);
}

/** Clicks in the order of the table, as the server has them, and new marks: a mark that is dragged leaves its row as it is. */
function sorted() {
  const sign = sorting.descending ? -1 : 1;
  return [...(state.view?.clicks ?? []), ...clicks().filter(({ id }) => !id)].sort((a, b) => sign * ((a[sorting.key] ?? -1) - (b[sorting.key] ?? -1)) || a.frame - b.frame);
}

/** The click that nextWorst went to last. @type {string|null} */
let lastVisited = null;

/** Go to the worst pair, outliers first, then by residual; when called again, to the next one. */
function nextWorst() {
  const ranked = clicks().filter((click) => click.residual_px !== null && click.state !== "excluded" && click.state !== "untouched");
  const outlier = (/** @type {Click} */ click) => Number(click.state === "outlier");
  ranked.sort((a, b) => outlier(b) - outlier(a) || Number(b.residual_px) - Number(a.residual_px));
  if (!ranked.length) return;
  const at = lastVisited === state.selected ? ranked.findIndex((click) => click.id === lastVisited) : -1;
  const next = ranked[(at + 1) % ranked.length];
  lastVisited = next.id;
  goToPair(next.id);
}

/** @param {string} id of a click */
export function goToPair(id) {
  const click = clicks().find((one) => one.id === id);
  if (!click) return;
  comeTo(click.frame);
  select(id);
}

function draw() {
  if (state.looking) return; // image/birdseye.js shows the placements
  const rows = sorted();
  count.textContent = rows.length ? String(rows.length) : "";
  const text = JSON.stringify([sorting, rows.length > 0]);
  const held = document.activeElement?.matches("[data-act]") ? idOf(document.activeElement) : undefined;
  const changed = drawRows(rows);
  if (text !== drawn) {
    page.replaceChildren(rows.length ? table : reflector());
    head.replaceChildren(make("tr", "", COLUMNS.map(heading)));
  } else if (!changed) return drawCandidateRows();
  drawn = text;
  drawCandidateRows();
  if (held) /** @type {HTMLElement|null|undefined} */ (made.get(held)?.row.querySelector("[data-act]"))?.focus({ preventScroll: true });
  const selected = made.get(state.selected ?? "")?.row;
  if (selected && shownRow !== state.selected) selected.scrollIntoView({ block: "nearest" });
  shownRow = selected ? state.selected : null;
}

/** What to click, before there is a pair: a trihedral reflector with its inner corner marked. */
function reflector() {
  const parts = [["left", "M60 4 60 62 6 98z"], ["right", "M60 4 60 62 114 98z"], ["floor", "M60 62 6 98 114 98z"], ["corner", "M60 53a9 9 0 1 0 .01 0z"]];
  const drawing = shape("svg", { viewBox: "0 0 120 104", "aria-hidden": "true" }, parts.map(([name, d]) => shape("path", { d, class: name })));
  const words = ["At every placement, mark the ", make("strong", "", "inner corner"), ", where the three plates meet. You need at least 8 placements."];
  return make("figure", "reflector", [drawing, make("figcaption", "", words)]);
}

/** Bring the rows up to date, one by one. @param {Click[]} rows @returns {boolean} whether any changed */
function drawRows(rows) {
  const keys = new Set(rows.map(keyOf));
  let changed = false;
  for (const [key, { row }] of made) {
    if (keys.has(key)) continue;
    row.remove();
    made.delete(key);
    changed = true;
  }
  /** @type {Element|null} */
  let next = body.firstElementChild;
  const follower = (/** @type {Element} */ row) => (row.nextElementSibling === choices ? choices.nextElementSibling : row.nextElementSibling);
  for (const click of rows) {
    const before = made.get(keyOf(click));
    const from = [click, click.id === state.selected, state.placements, state.seconds];
    let row = before?.row;
    if (!row || from.some((value, index) => value !== before?.from[index])) {
      row = line(click);
      if (next === before?.row) next = row;
      before?.row.replaceWith(row);
      made.set(keyOf(click), { from, row });
      changed = true;
    }
    if (row === next) next = follower(row);
    else {
      body.insertBefore(row, next);
      changed = true;
    }
  }
  return changed;
}

/** The returns that may belong to the selected click, below its row. */
const choices = make("tr", "choices", []);

function drawCandidateRows() {
  const id = state.selected ?? "";
  const rows = candidatesOf(id);
  const owner = made.get(id)?.row;
  const text = JSON.stringify([id, rows]);
  if (!owner?.isConnected || (rows.length < 2 && !rows.some((row) => row.chosen))) {
    choices.remove();
    choices.dataset.drawn = "";
    return;
  }
  if (choices.dataset.drawn !== text) {
    const cell = make("td", "", [make("div", "choices-list", rows.slice(0, MOST_CHOICES).map(candidateRow))]);
    cell.colSpan = COLUMNS.length;
    choices.replaceChildren(cell);
    choices.dataset.drawn = text;
  }
  if (owner.nextElementSibling === choices) return;
  owner.after(choices);
  choices.scrollIntoView({ block: "nearest" });
  owner.scrollIntoView({ block: "nearest" });
}

/** @param {import("../messages.js").CandidateRow} row @param {number} index */
function candidateRow(row, index) {
  const asked = state.candidates?.asked.includes(index);
  const chance = row.probability === null ? "" : `${Math.round(100 * row.probability)} %`;
  const away = row.distance_px === null ? "" : `${digits(row.distance_px)} px away`;
  const button = make("button", `choice${row.used ? " used" : ""}${asked ? " asked" : ""}`, [
    make("b", "", row.chosen ? "✓" : String(index + 1)),
    make("span", "where", row.words),
    make("span", "", away),
    make("span", "", row.snr_db === null ? "" : `${row.snr_db.toFixed(0)} dB`),
    make("span", "", chance),
  ]);
  button.dataset.choice = String(index);
  button.setAttribute("aria-pressed", String(row.used));
  const why = row.chosen ? "You chose this return. Click again to leave the choice to the program." : row.used ? "This return is used. Click to fix the choice." : "Click to choose this return for the click.";
  button.dataset.hint = `${why}\nSeen in ${row.scans} scans. ${row.distance_px === null ? "The percentage says how plausible it is among the others, before there is a pose." : "The percentage says how probable it is, given the click and the pose."}`;
  return button;
}

/** A name for a row; a click that is not confirmed has no id yet. @param {Click} click */
const keyOf = (click) => click.id || `${stampKey(click.image_time)} ${click.u_px} ${click.v_px}`;

/** @param {(typeof COLUMNS)[number]} column */
function heading(column) {
  const cell = make("th", "", []);
  cell.scope = "col";
  if (!column.key) cell.textContent = column.label;
  if (!column.key) return cell;
  const button = make("button", "", column.label);
  button.dataset.sort = column.key;
  button.dataset.hint = column.hint;
  cell.append(button);
  if (sorting.key === column.key) cell.setAttribute("aria-sort", sorting.descending ? "descending" : "ascending");
  return cell;
}

/** @param {Click} click */
function line(click) {
  const colour = residualColour(click.residual_px);
  const bar = make("b", "", "");
  bar.style.width = `${Math.min(100, (100 * (click.residual_px ?? 0)) / LARGE_PX)}%`;
  bar.style.background = colour;
  const residual = click.residual_px === null || click.state === "untouched" ? word(click) : residualText(click.residual_px);
  const excluded = click.state === "excluded";
  const act = make("input", "act", []);
  act.type = "checkbox";
  const guess = click.state === "untouched";
  act.checked = !excluded && !guess;
  act.setAttribute("aria-label", `Use ${nameOf(click.id)} in the calibration`);
  act.dataset.hint = guess ? "A guess: it does not count until it is moved to the reflector. Click to exclude it (X)" : excluded ? "Excluded. Click to include it again (X)" : "Used in the calibration. Click to exclude it (X)";
  act.dataset.act = "exclude";
  const range = click.range_m === null ? "–" : `${click.range_m.toFixed(1)} m`;
  const row = make("tr", `row ${click.state}`, [
    make("td", "", [make("span", "name", [glyph(click.state, colour), nameOf(click.id)])]),
    make("td", "", timeText(state.seconds[click.frame] ?? 0, 2)),
    make("td", "", range),
    make("td", "bar", [make("span", "meter", [make("i", "", [bar]), make("span", "", residual)])]),
    make("td", "", [act]),
  ]);
  row.dataset.id = click.id;
  row.setAttribute("aria-selected", String(click.id !== "" && click.id === state.selected));
  row.dataset.hint = explain(click);
  return row;
}

/** @param {Click} click */
const word = (click) => ({ unpaired: "no return", pending: "…", untouched: "guess" })[/** @type {string} */ (click.state)] ?? "–";

/** @param {Click} click */
function explain(click) {
  const how = { clicked: "click", moved: "moved mark", snapped: "mark on the corner found in the image", untouched: "guess" }[click.mark];
  const lines = [`${nameOf(click.id)}: ${how} at ${click.u_px.toFixed(1)}, ${click.v_px.toFixed(1)} px`];
  if (click.projected_px) lines.push(`reprojected at ${click.projected_px.map((value) => value.toFixed(1)).join(", ")} px`);
  if (click.sigma_px !== null) lines.push(`its own standard deviation: ${click.sigma_px.toFixed(2)} px`);
  if (click.range_m !== null) lines.push(`radar: ${click.range_m.toFixed(2)} m, ${toSide(click.azimuth_deg, "left", "right")}, ${toSide(click.elevation_deg, "up", "down")}${click.chosen ? ", chosen by you" : ""}`);
  if (click.note) lines.push(click.note);
  return lines.join("\n");
}

/** An angle with its side. @param {number|null} angle deg @param {string} positive @param {string} negative */
const toSide = (angle, positive, negative) => (angle === null ? "" : Math.abs(angle) < 0.05 ? "0.0°" : `${Math.abs(angle).toFixed(1)}° ${angle > 0 ? positive : negative}`);

/** The shape shows the state, in addition to the colour. @param {string} clickState @param {string} colour */
function glyph(clickState, colour) {
  const hollow = ["excluded", "unpaired", "pending", "untouched"].includes(clickState);
  const d = clickState === "outlier" ? "M6 .8 11.2 6 6 11.2.8 6z" : "M6 2.2a3.8 3.8 0 1 0 .01 0z";
  const dashes = clickState === "pending" || clickState === "untouched" ? "2 2" : "none";
  const path = shape("path", { d, fill: hollow ? "none" : colour, stroke: colour, "stroke-width": 1.5, "stroke-dasharray": dashes });
  return shape("svg", { viewBox: "0 0 12 12", role: "img", "aria-label": clickState }, [path]);
}

/** The id of the click whose row contains an element. @param {Element} element */
const idOf = (element) => /** @type {HTMLElement|null} */ (element.closest("[data-id]"))?.dataset.id;

/** @param {MouseEvent} event */
function pressed(event) {
  const target = /** @type {Element} */ (event.target);
  const key = target.closest("[data-sort]")?.getAttribute("data-sort");
  if (key) {
    sorting.descending = sorting.key === key ? !sorting.descending : key === "residual_px";
    sorting.key = /** @type {typeof sorting.key} */ (key);
    return draw();
  }
  const choice = target.closest("[data-choice]")?.getAttribute("data-choice");
  if (choice) return void choose(candidatesOf(state.selected ?? "")[Number(choice)]?.chosen ? -1 : Number(choice));
  const id = idOf(target);
  const click = clicks().find((row) => row.id === id && id !== "");
  if (!click) return;
  select(click.id);
  if (target.closest("[data-act]")) {
    event.preventDefault(); // the checkbox changes once the server confirms
    return void toggleExcluded();
  }
  comeTo(click.frame);
}
