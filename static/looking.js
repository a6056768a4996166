/** A recording without pictures: what the page shows instead of the picture, its controls, and the table of placements. */

import { amplitudeRange, rampColour } from "./amplitude.js";
import { describe, side, startBirdseye } from "./birdseye.js";
import { make } from "./notices.js";
import { goTo, pause, tellCursor } from "./player.js";
import { emit, on, placementAt, state } from "./state.js";

const page = /** @type {HTMLElement} */ (document.getElementById("page-pairs"));
const group = /** @type {HTMLElement} */ (document.getElementById("look-options"));
const legend = /** @type {HTMLElement} */ (document.getElementById("legend"));
const guide = /** @type {HTMLElement} */ (document.getElementById("guide"));
const TRAILS_S = [0, 2, 10];
/** Controls that need pictures. */
const NEED_PICTURES = ["undo", "redo", "export"];

export function startLooking() {
  startBirdseye();
  on(["recording"], enter);
  on(["recording", "placements", "radar_map", "cursor", "layers", "theme"], draw);
  page.addEventListener("click", (event) => {
    const row = /** @type {Element} */ (event.target).closest("[data-placement]");
    if (!row || !state.looking) return;
    pause();
    goTo(state.placements[Number(row.getAttribute("data-placement"))].frame);
  });
}

/** Show what is there without pictures, once. */
function enter() {
  document.body.classList.toggle("looking", state.looking);
  if (!state.looking) return;
  const why = "There are no pictures in this recording: nothing can be clicked. Add the camera's file to calibrate.";
  for (const id of NEED_PICTURES) {
    const button = /** @type {HTMLButtonElement} */ (document.getElementById(id));
    button.disabled = true;
    button.dataset.hint = why;
  }
  const tab = /** @type {HTMLElement} */ (document.getElementById("tab-pairs"));
  tab.textContent = "Placements";
  tab.click();
}

function draw() {
  if (!state.looking) return;
  drawOptions();
  drawLegend();
  drawTable();
  const here = placementAt(state.cursor);
  guide.hidden = !here;
  guide.classList.toggle("act", Boolean(here?.note));
  if (here) guide.textContent = [describe(here), here.note].filter(Boolean).join(": ");
}

function drawOptions() {
  const { trail_s: trail, colour, map, whole } = state.lookOptions;
  const next = TRAILS_S[(TRAILS_S.indexOf(trail) + 1) % TRAILS_S.length];
  const hasAmplitude = amplitudeRange() !== null;
  const chips = [
    chip(trail ? `Last ${trail} s` : "One scan", "For how long returns stay; they fade with age. Click for longer.", trail > 0, { trail_s: next }),
    chip("Whole recording", "Where there were static returns at any time: the stronger, the longer. What is faint came and went.", map, { map: !map, whole: !whole }),
  ];
  if (hasAmplitude) chips.push(chip("Amplitude", "Colour by amplitude, else by speed: static returns are blue dots, moving ones orange triangles.", colour === "amplitude", { colour: colour === "amplitude" ? "speed" : "amplitude" }));
  group.replaceChildren(...chips);
}

/** @param {string} label @param {string} hint @param {boolean} pressed @param {Partial<typeof state.lookOptions>} change */
function chip(label, hint, pressed, change) {
  const made = make("button", "chip", label);
  made.dataset.hint = hint;
  made.setAttribute("aria-pressed", String(pressed));
  made.onclick = () => {
    Object.assign(state.lookOptions, change);
    emit("layers");
    tellCursor();
  };
  return made;
}

/** What the colours mean. */
function drawLegend() {
  const range = amplitudeRange();
  if (state.lookOptions.colour === "amplitude" && range) {
    const steps = Array.from({ length: 24 }, (_, index) => {
      const step = make("i", "", []);
      step.style.background = rampColour(index / 23);
      return step;
    });
    legend.replaceChildren(`${range[0].toFixed(0)}`, make("span", "ramp", steps), `${range[1].toFixed(0)} dB`, make("span", "key", "● static"), make("span", "key", "△ moving"));
  } else legend.replaceChildren(make("span", "still", "● static"), make("span", "moving", "△ moving"));
}

function drawTable() {
  const here = placementAt(state.cursor);
  if (!state.placements.length) {
    const words = state.placementsKnown ? state.placementSummary : "Searching the radar data for places where the reflector stood still…";
    return page.replaceChildren(make("p", "none-found", words ? `${words}.` : "The radar data could not be searched."));
  }
  const heads = [["", ""], ["Time", "From when on, since the first scan"], ["Lasted", "How long it stood still"], ["Range", "Distance from the radar"], ["Azimuth", "Angle from straight ahead"], ["Amplitude", "Mean amplitude of its returns"], ["Above", "Above the strong static returns elsewhere at its range, while it stood"]];
  const head = make("tr", "", heads.map(([label, hint]) => {
    const cell = make("th", "", label);
    cell.scope = "col";
    if (hint) cell.dataset.hint = hint;
    return cell;
  }));
  const rows = state.placements.map((placement, index) => {
    const lasted = `${(placement.end_s - placement.start_s).toFixed(1)} s`;
    const cells = [String(index + 1), `${placement.start_s.toFixed(1)} s`, lasted, `${placement.range_m.toFixed(1)} m`, side(placement.azimuth_deg), decibels(placement.snr_db), decibels(placement.stands_out_db)];
    const row = make("tr", placement.note ? "row odd" : "row", cells.map((words) => make("td", "", words)));
    row.dataset.placement = String(index);
    row.dataset.hint = [describe(placement), placement.note].filter(Boolean).join("\n");
    row.setAttribute("aria-selected", String(placement === here));
    return row;
  });
  const top = page.scrollTop;
  page.replaceChildren(make("table", "pairs placements", [make("thead", "", [head]), make("tbody", "", rows)]));
  page.scrollTop = top;
  page.querySelector('[aria-selected="true"]')?.scrollIntoView({ block: "nearest" });
}

/** @param {number|null} value */
const decibels = (value) => (value === null ? "–" : `${value.toFixed(0)} dB`);
