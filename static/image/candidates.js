/**
 * The radar returns that may belong to the selected click: numbered rings on the frame, and the choice between them. A click on
 * a number chooses; C takes the one that would fit better, or else the next one; undo takes the choice back.
 */

import { growth, ink, smallFont } from "../base/colours.js";
import { addLayer } from "../base/layers.js";
import { toast } from "../base/notices.js";
import { send } from "../base/socket.js";
import { emit, on, selectedClick, stampOf, state } from "../base/state.js";
import { toCss, toDevice, viewport } from "./geometry.js";

/** @typedef {import("../messages.js").CandidateRow} Candidate */
/** Candidates that are less probable than this are not drawn on the frame, except the one in use and the suggested one. */
const LEAST = 0.01;
/** Numbers stand this far from their ring, so that a click at the reflector never chooses [CSS px]. */
const ASIDE = 20;
const RADIUS = 9;

export function startCandidates() {
  addLayer("candidates", drawCandidates);
  on(["selected", "view"], () => {
    if (state.candidates && state.candidates.click !== (state.selected ?? "")) take(null);
  });
}

/** @param {import("../messages.js").PairCandidates|null} message */
export function take(message) {
  state.candidates = message && message.rows.length && message.click === state.selected ? message : null;
  emit("candidates");
}

/** Its candidates, the most probable first; empty if none are known. @param {string} id of a click @returns {Candidate[]} */
export const candidatesOf = (id) => (id !== "" && state.candidates?.click === id ? state.candidates.rows : []);

/** Those that are drawn on the frame, with their numbers. @returns {{row: Candidate, number: number}[]} */
function drawn() {
  const click = selectedClick();
  if (!click || click.frame !== state.shown?.index || !state.candidates) return [];
  const suggested = state.candidates.suggested;
  return candidatesOf(click.id)
    .map((row, index) => ({ row, number: index + 1 }))
    .filter(({ row, number }) => row.u_px !== null && (row.used || number - 1 === suggested || (row.probability ?? 0) >= LEAST));
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
  for (const { row, number } of here) {
    const [x, y] = toDevice(Number(row.u_px), Number(row.v_px));
    const suggested = number - 1 === state.candidates?.suggested;
    if (!row.used) ring(pen, x, y, suggested);
    const [bx, by] = badge(row).map((value) => value * ratio);
    pen.beginPath();
    pen.arc(bx, by, RADIUS * 0.85 * unit, 0, 2 * Math.PI);
    pen.fillStyle = row.used ? ink.ring : suggested ? ink.guess : "rgb(20 26 32 / 85%)";
    pen.fill();
    pen.lineWidth = unit;
    pen.strokeStyle = ink.guess;
    pen.stroke();
    pen.font = smallFont(0.9 * ratio, "600");
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.fillStyle = row.used || suggested ? "#10161c" : "#ffffff";
    pen.fillText(row.chosen ? "✓" : String(number), bx, by + 0.5 * unit);
    pen.textBaseline = "alphabetic";
  }
}

/** @param {CanvasRenderingContext2D} pen @param {number} x @param {number} y @param {boolean} suggested */
function ring(pen, x, y, suggested) {
  for (const [colour, width] of /** @type {[string, number][]} */ ([[ink.edge, 3], [ink.guess, suggested ? 1.8 : 1.1]])) {
    pen.beginPath();
    pen.setLineDash(suggested ? [] : [2 * viewport.unit, 2.5 * viewport.unit]);
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

/** Take the return that would fit better, or else the one after the present one; after the last, leave it to the program again. */
export function nextCandidate() {
  const candidates = state.candidates;
  if (!candidates) return;
  if (candidates.suggested >= 0) return choose(candidates.suggested);
  const now = candidates.rows.findIndex((row) => row.used);
  const chosen = candidates.rows.some((row) => row.chosen);
  const next = now + 1;
  if (next >= candidates.rows.length) return choose(chosen ? -1 : 0);
  return choose(next);
}

/** Why no candidate can be chosen now; "" if one can. */
export function withoutCandidates() {
  if (!selectedClick()) return "No mark is selected: go to one first";
  if (!state.candidates) return "No radar return is known for this mark yet";
  return state.candidates.rows.length > 1 || state.candidates.rows.some((row) => row.chosen) ? "" : "There is no other return near this mark";
}
