/**
 * The radar returns that may belong to the selected click: numbered rings on the frame, and the question which one it is. C shows
 * one after the other, Enter keeps what is shown, a click on a number chooses it; undo takes the choice back.
 */

import { growth, ink, smallFont } from "../base/colours.js";
import { addLayer } from "../base/layers.js";
import { toast } from "../base/notices.js";
import { send } from "../base/socket.js";
import { emit, on, selectedClick, stampOf, state } from "../base/state.js";
import { toCss, toDevice, viewport } from "./geometry.js";

/** @typedef {import("../messages.js").CandidateRow} Candidate */
/** Candidates that are less probable than this are not drawn on the frame, except the one in use and those that are asked about. */
const LEAST = 0.01;
/** Numbers stand this far from their ring, so that a click at the reflector never chooses [CSS px]. */
const ASIDE = 20;
const RADIUS = 9;
/** Of more candidates that nobody asks about, C shows the most probable. */
const MOST_SHOWN = 6;
/** The row that C shows; -1 before it is pressed. */
let at = -1;

export function startCandidates() {
  addLayer("candidates", drawCandidates);
  on(["selected", "view"], () => {
    if (state.candidates && state.candidates.click !== (state.selected ?? "")) take(null);
  });
}

/** @param {import("../messages.js").PairCandidates|null} message */
export function take(message) {
  if (message?.click !== state.candidates?.click || message?.revision !== state.candidates?.revision) at = -1;
  state.candidates = message && message.rows.length && message.click === state.selected ? message : null;
  emit("candidates");
}

/** Its candidates, the most probable first; empty if none are known. @param {string} id of a click @returns {Candidate[]} */
export const candidatesOf = (id) => (id !== "" && state.candidates?.click === id ? state.candidates.rows : []);

/** Those that are drawn on the frame, with their numbers. @returns {{row: Candidate, number: number}[]} */
function drawn() {
  const click = selectedClick();
  if (!click || click.frame !== state.shown?.index || !state.candidates) return [];
  const asked = question()?.rows ?? [];
  return candidatesOf(click.id)
    .map((row, index) => ({ row, number: index + 1 }))
    .filter(({ row, number }) => row.u_px !== null && (row.used || asked.includes(number - 1) || (row.probability ?? 0) >= LEAST));
}

/** Where the number of a candidate stands [CSS px]. @param {Candidate} row @returns {[number, number]} */
function badge(row) {
  const [x, y] = toCss(Number(row.u_px), Number(row.v_px));
  const aside = ASIDE * 0.8 * growth();
  return [x + aside, y - aside];
}

/** The candidate whose number is at a point of the canvas box [CSS px]; -1 if there is none. @param {number} x @param {number} y */
export function candidateNear(x, y) {
  const here = drawn();
  if (here.length < 2) return -1;
  const near = here.find(({ row }) => Math.hypot(badge(row)[0] - x, badge(row)[1] - y) <= RADIUS * growth());
  return near ? near.number - 1 : -1;
}

/** Rings at the reprojections of the candidates: the one in use is drawn by the mark itself. @param {CanvasRenderingContext2D} pen */
function drawCandidates(pen) {
  const here = drawn();
  if (here.length < 2) return;
  const { ratio, unit } = viewport;
  const shown = question()?.shown;
  for (const { row, number } of here) {
    const [x, y] = toDevice(Number(row.u_px), Number(row.v_px));
    const isShown = number - 1 === shown;
    if (!row.used || isShown) ring(pen, x, y, isShown);
    const [bx, by] = badge(row).map((value) => value * ratio);
    pen.beginPath();
    pen.arc(bx, by, RADIUS * 0.85 * unit, 0, 2 * Math.PI);
    pen.fillStyle = isShown ? ink.guess : row.used ? ink.ring : "rgb(20 26 32 / 85%)";
    pen.fill();
    pen.lineWidth = unit;
    pen.strokeStyle = ink.guess;
    pen.stroke();
    pen.font = smallFont(0.9 * ratio, "600");
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.fillStyle = row.used || isShown ? "#10161c" : "#ffffff";
    pen.fillText(row.chosen ? "✓" : String(number), bx, by + 0.5 * unit);
    pen.textBaseline = "alphabetic";
  }
}

/** @param {CanvasRenderingContext2D} pen @param {number} x @param {number} y @param {boolean} isShown */
function ring(pen, x, y, isShown) {
  for (const [colour, width] of /** @type {[string, number][]} */ ([[ink.edge, 3], [ink.guess, isShown ? 1.8 : 1.1]])) {
    pen.beginPath();
    pen.setLineDash(isShown ? [] : [2 * viewport.unit, 2.5 * viewport.unit]);
    pen.arc(x, y, 8 * viewport.unit, 0, 2 * Math.PI);
    pen.lineWidth = width * viewport.unit;
    pen.strokeStyle = colour;
    pen.stroke();
  }
  pen.setLineDash([]);
}

/** Say that the selected click belongs to one of its candidates. @param {number} index of the row; -1 takes the choice back */
export async function choose(index) {
  const candidates = state.candidates;
  const click = selectedClick();
  if (!candidates || !click || candidates.click !== click.id) return;
  const row = candidates.rows[index];
  const chosen = row ? { position_m: row.position_m, radar_time: stampOf(click.frame), topic: state.recording?.radar_topic ?? "" } : null;
  const refusal = await send({ type: "return_chosen", id: click.id, return: chosen });
  if (refusal) toast(refusal);
}

/**
 * The question which return the selected click belongs to: the rows to choose from, and the one that is shown; null if it is not
 * asked, by the server or by C.
 * @returns {{rows: number[], shown: number}|null}
 */
export function question() {
  const candidates = state.candidates;
  if (!candidates || selectedClick()?.frame !== state.shown?.index) return null;
  if (!candidates.asked.length && at < 0) return null;
  const rows = candidates.asked.length ? candidates.asked : candidates.rows.slice(0, MOST_SHOWN).map((_, index) => index);
  return { rows, shown: at < 0 ? rows[0] : at };
}

/** Show the return after the one that is shown, or after the one in use. */
export function nextCandidate() {
  const candidates = state.candidates;
  if (!candidates) return;
  if (at < 0) at = Math.max(0, candidates.rows.findIndex((row) => row.used));
  const rows = question()?.rows ?? [];
  at = rows[(rows.indexOf(at) + 1) % rows.length] ?? -1;
  emit("candidates");
}

/** Keep the return that is shown. @returns {boolean} whether it was asked for */
export function keepCandidate() {
  const asked = question();
  if (asked) void choose(asked.shown);
  return asked !== null;
}

/** Why no candidate can be chosen now; "" if one can. */
export function withoutCandidates() {
  if (!selectedClick()) return "No mark is selected: go to one first";
  if (!state.candidates) return "No radar return is known for this mark yet";
  return state.candidates.rows.length > 1 || state.candidates.rows.some((row) => row.chosen) ? "" : "There is no other return near this mark";
}
