/**
 * Proposals of where the reflector stood, one placement at a time: N goes to the next one, Enter accepts what the image shows, C
 * takes another place, X says that it is not the reflector, a click puts the mark elsewhere. They are found on the server.
 */

import { toast } from "../base/notices.js";
import { offers } from "../base/offers.js";
import { send } from "../base/socket.js";
import { clickIn, emit, isOffered, on, placementsAt, state } from "../base/state.js";
import { dismiss } from "../image/dismissing.js";
import { lookAt, lookInto, pan, toCss, viewport, zoom, zoomAt } from "../image/geometry.js";
import { fit, redraw } from "../image/image.js";
import { goTo, pause } from "../time/player.js";

/** @typedef {import("../messages.js").ProposalRow} Row */
/** @typedef {import("../messages.js").ProposalPlace} Place */
/** @typedef {import("../base/offers.js").Offer} Offer */

/** Nothing is decided so soon after a proposal appeared, or moved to a better place [ms]: nobody has seen it yet. */
const UNSEEN = 300;
/** A place that moved by less is the same [px]. */
const SAME_PX = 1;

/** The last proposal of each placement: it stays while its placement has a click, since undo takes that back. @type {Map<number, Row>} */
const known = new Map();
/** Placements that were decided here and not confirmed by the server yet. @type {Set<number>} */
const sent = new Set();
/** Those decided here, the last one at the end; undo leads back to it. @type {number[]} */
const decided = [];
/** Decided placements that the server's view had as decided. @type {Set<number>} */
const closed = new Set();
/** Those that N left undecided in this round. @type {Set<number>} */
const skipped = new Set();
/** The way back. @type {number[]} */
const visited = [];
/** Which place is taken where it is not the first one. @type {Map<number, number>} */
const taken = new Map();
/** The placement that N went to. @type {number|null} */
let current = null;
/** The frame to zoom into once it is shown. @type {Row|null} */
let awaited = null;
/** When the proposal on screen appeared there, or moved [ms]. */
let moved = -Infinity;
/** The placement whose proposal is on screen. @type {number|undefined} */
let seen;
/** Placements that were decided or clicked here and whose decision is on its way, with what was decided. @type {Map<number, string>} */
const onTheWay = new Map();
/** Whether the last proposal was decided just now: Enter then means nothing else until another key is pressed, or the pointer. */
let over = false;

/** A proposal this sure is what the page opens on, if it is ready by then. */
const SURE = 0.9;
/** Whether the image may still move by itself: nothing was pressed, and it is not the one that was there before a reload. */
let isFresh = sessionStorage.getItem("cocalib-frame") === null;

export function startProposals() {
  Object.assign(offers, { shown: shownOffer, confidences, clicked: correctProposal });
  for (const type of ["keydown", "pointerdown", "wheel"]) addEventListener(type, () => (isFresh = false), { capture: true });
  on(["placements", "proposals", "view"], openOn);
  on(["shown"], arrive);
  on(["shown", "view", "proposals", "placements", "playing"], notice);
  on(["view"], settle);
  on(["playing"], () => state.playing && (awaited = null));
  addEventListener("keydown", (event) => event.key !== "Enter" && (over = false), { capture: true });
  addEventListener("pointerdown", () => (over = false), { capture: true });
}

/** @param {import("../messages.js").ProposalNews} message */
export function takeProposals(message) {
  const before = shownOffer();
  const silent = new Set(message.unproposed.map((one) => one.placement));
  for (const placement of known.keys()) if (silent.has(placement)) known.delete(placement);
  for (const row of message.rows) {
    if (row.places[0] && !samePlace(row.places[0], known.get(row.placement)?.places[0])) taken.delete(row.placement);
    known.set(row.placement, row);
  }
  if (!message.on) known.clear();
  state.proposals = message;
  const after = shownOffer();
  if (before && after && before.row.placement === after.row.placement && !samePlace(before.place, after.place)) {
    moved = performance.now();
    if (before.row.placement === current) zoomInto(after);
  }
  emit("proposals");
}

/** Open on the first placement, or on a proposal that is ready and sure; once. */
function openOn() {
  const isMoved = state.cursor !== 0 || state.following !== null || state.looking || state.proposals === null;
  const first = state.placements.find(isOffered);
  if (!isFresh || isMoved || !first || !state.view || state.view.solving || state.view.verdict.done) return;
  isFresh = false;
  const best = openProposals()[0];
  if (best?.confidence > SURE) show(best);
  else goTo(first.frame);
}

/** What the line says for a moment. */
let said = { text: "", until: 0 };

/** Say sentences in the line on the frame for a while. @param {string} text @param {number} [ms] */
export function say(text, ms = 5000) {
  said = { text, until: performance.now() + ms };
  emit("proposals");
  if (text) setTimeout(() => emit("proposals"), ms + 20);
}

/** What is being said now, in sentences; "" if nothing. */
export const saidWords = () => (performance.now() < said.until ? said.text : "");

/** While proposals are still being found. */
export const isSearching = () => Boolean(state.proposals?.on && state.proposals.progress.stage === "looking");

/** How far the search is; "" if none is going on. */
export const searchWords = () => (isSearching() ? `Searching, ${state.proposals?.progress.done} of ${state.proposals?.progress.count}` : "");

/** Take note of a proposal that has just appeared on screen. */
function notice() {
  const now = shownOffer()?.row.placement;
  if (now === seen) return;
  seen = now;
  if (now !== undefined) moved = performance.now();
}

/** @param {Place} one @param {Place|undefined} other */
const samePlace = (one, other) => other !== undefined && Math.hypot(one.pixel_px[0] - other.pixel_px[0], one.pixel_px[1] - other.pixel_px[1]) < SAME_PX;

/** Whether a placement still waits for a decision. @param {number} placement */
const isOpen = (placement) => !sent.has(placement) && state.placements[placement] !== undefined && isOffered(state.placements[placement]);

/** The proposals that wait for a decision: the sure ones as their placements follow each other, then the others, the most confident first. @returns {Row[]} */
export function openProposals() {
  if (!state.proposals?.on) return [];
  const rows = state.proposals.rows;
  const kept = [...known.values()].filter((row) => !rows.includes(row));
  const turn = (/** @type {Row} */ row) => (row.confidence > SURE ? row.placement : state.placements.length);
  return [...rows, ...kept].filter((row) => isOpen(row.placement)).sort((one, other) => turn(one) - turn(other));
}

/** How sure the proposals are that wait for a decision, by the number of their placement. @returns {Map<number, number>} */
const confidences = () => new Map(openProposals().map(({ placement, confidence }) => [placement, confidence]));

/** The proposal on screen: that which N went to, or else the most confident one of the frame. @returns {Offer|null} */
export function shownOffer() {
  if (!state.shown || state.playing || state.rectified) return null;
  const seconds = state.seconds[state.shown.index];
  const here = openProposals().filter(({ placement }) => state.placements[placement].start_s <= seconds && seconds <= state.placements[placement].end_s);
  const row = here.find(({ placement }) => placement === current) ?? here[0];
  if (!row) return null;
  const number = Math.min(taken.get(row.placement) ?? 0, row.places.length - 1);
  return { row, place: row.places[number], number, isOpen: taken.has(row.placement) };
}

/** Go to the proposal that is to be decided next; one on screen that was not decided waits for the next round. @returns {boolean} whether there is one */
export function nextProposal() {
  const here = shownOffer()?.row.placement;
  if (here !== undefined) skipped.add(here);
  const open = openProposals();
  if (open.every(({ placement }) => skipped.has(placement))) skipped.clear();
  const next = open.find(({ placement }) => placement !== here && !skipped.has(placement)) ?? open[0];
  if (!next) return false;
  if (here !== undefined && next.placement !== here) visited.push(here);
  show(next);
  return true;
}

/** Go back to the proposal before. @returns {boolean} whether there is one */
export function previousProposal() {
  while (visited.length) {
    const placement = Number(visited.pop());
    const row = openProposals().find((one) => one.placement === placement);
    if (!row) continue;
    skipped.delete(placement);
    show(row);
    return true;
  }
  return false;
}

/** @param {Row} row */
function show(row) {
  current = row.placement;
  skipped.delete(row.placement);
  awaited = row;
  pause();
  goTo(row.frame);
  arrive();
  emit("proposals");
}

function arrive() {
  if (!awaited || state.shown?.index !== awaited.frame) return;
  const offer = shownOffer();
  awaited = null;
  if (offer) zoomInto(offer);
}

/** Whether what is on screen appeared there a moment ago. */
export const justMoved = () => performance.now() - moved < UNSEEN;

/** What was decided at the frame on screen and waits for the server to come back; "" if nothing does. */
export function heldBack() {
  if (state.connected || !state.shown || shownOffer()) return "";
  const here = placementsAt(state.shown.index).map((placement) => state.placements.indexOf(placement));
  return onTheWay.get(here.find((placement) => onTheWay.has(placement)) ?? -1) ?? "";
}

/** Whether Enter leads to a proposal: some wait, and there is nothing to mark on screen, or its proposal may come yet. */
const leadsOn = () => openProposals().length > 0 && state.shown !== null && !clickIn(state.shown.index) && (isSearching() || !placementsAt(state.shown.index).some(isOffered));

/** Whether N, or a decision, leads to a proposal whose frame is not on screen yet. */
const isComing = () => awaited !== null && state.cursor === awaited.frame && state.shown?.index !== awaited.frame;

/** Whether X and C are about proposals: one is on screen, or about to be. */
export const takesKeys = () => shownOffer() !== null || isComing();

/** Whether Enter is about proposals: one is on screen or elsewhere, was decided without the server, or the last one was decided just now. */
export const takesEnter = () => takesKeys() || heldBack() !== "" || leadsOn() || (over && !openProposals().length);

/** The proposal on screen, once somebody can have seen it. @returns {Offer|null} */
function seenOffer() {
  const offer = shownOffer();
  if (!isComing() && (!offer || !justMoved())) return offer;
  say("Just shown: press again.", 1000);
  return null;
}

/** Whether the cross of a proposal is in view, in the frame that it is of. @param {Offer} offer */
function isInView({ row, place }) {
  const [x, y] = toCss(...place.pixel_px);
  return state.shown?.index === row.frame && x >= 0 && y >= 0 && x <= viewport.width && y <= viewport.height;
}

/** Enter: what the image shows becomes a mark, and the next proposal is shown. */
export async function acceptProposal() {
  if (!takesKeys()) return void (heldBack() || nextProposal());
  const offer = seenOffer();
  if (!offer) return;
  if (!isInView(offer)) {
    show(offer.row);
    moved = performance.now();
    return say("Back at the proposal: look, then press Enter again.");
  }
  const { pixel_px, sigma_px } = offer.place;
  const { placement, image_time } = offer.row;
  const mark = /** @type {const} */ ("snapped");
  const key = `proposal-${placement}`;
  state.local.set(key, { u: pixel_px[0], v: pixel_px[1], image_time, mark });
  await decide(offer.row, "Accepted", { type: "click_placed", image_time, pixel_px, mark, sigma_px }, key);
}

/** X: it is not the reflector. */
export async function rejectProposal() {
  const offer = seenOffer();
  if (offer) await decide(offer.row, "Dismissed", dismiss(state.placements[offer.row.placement]));
}

/** @param {Row} row @param {string} word @param {Record<string, any>} message @param {string} [key] of the mark shown until the server has it */
async function decide(row, word, message, key = "") {
  sent.add(row.placement);
  decided.push(row.placement);
  const refusal = await goOnWhile(row, word, send(message));
  state.local.delete(key);
  if (refusal) sent.delete(row.placement);
  emit("view");
  if (!refusal) return;
  toast(refusal, "The proposal is offered again.");
  emit("proposals");
}

/** A click decides the proposal on screen: the next one is shown; undo leads back. @param {Offer} offer @param {Promise<string|null>} sending */
async function correctProposal({ row }, sending) {
  const refusal = await goOnWhile(row, "Marked", sending);
  if (refusal) return;
  decided.push(row.placement);
  settle();
}

/** Show the next proposal while a decision is sent; without a server, once it is back. @param {Row} row @param {string} word @param {Promise<string|null>} sending */
async function goOnWhile(row, word, sending) {
  const [wasConnected, cursor] = [state.connected, state.cursor];
  say("");
  onTheWay.set(row.placement, word);
  emit("view");
  if (wasConnected) goOn();
  const refusal = await sending;
  onTheWay.delete(row.placement);
  if (!wasConnected && !refusal && state.cursor === cursor) goOn();
  return refusal;
}

function goOn() {
  if (!nextProposal()) finish();
}

function finish() {
  current = null;
  over = true;
  fit();
  emit("proposals");
}

/** C: the next place where the reflector may stand. */
export function nextPlace() {
  const offer = seenOffer();
  if (!offer) return;
  taken.set(offer.row.placement, (offer.number + 1) % offer.row.places.length);
  const after = shownOffer();
  if (after) zoomInto(after);
  emit("proposals");
}

/** The server has what was decided; a decision that was undone is shown again. */
function settle() {
  for (const placement of sent) if (!onTheWay.has(placement) && state.placements[placement] && !isOffered(state.placements[placement])) sent.delete(placement);
  const last = decided[decided.length - 1];
  if (last === undefined || sent.has(last)) return;
  if (!isOpen(last)) return void closed.add(last);
  if (!closed.delete(last)) return;
  decided.pop();
  const row = openProposals().find(({ placement }) => placement === last);
  if (row) show(row);
}

/** What is shown of the image around a proposal: so many widths of the reflector, and at least this part of the image. */
const WIDTHS = 9;
const PART = 0.1;
/** Under fingers it is shown at least as large as this [CSS px per image px]; image/inset.js shows the whole image. */
const TOUCH_ZOOM = 3;
/** Room below a proposal for the line on the frame, so that it does not cover the reflector [CSS px]. */
const BELOW = 120;

/** The middle of a view of a place, such that the image fills the view if it can. @param {number} at image px @param {number} box CSS px @param {number} size image px */
function within(at, box, size) {
  const half = box / zoom() / 2;
  return half > size / 2 ? (size - 1) / 2 : Math.min(size - 0.5 - half, Math.max(half - 0.5, at));
}

/** Zoom into the place that is taken of a proposal. @param {Offer} offer */
function zoomInto({ row, place }) {
  const field = Math.max(WIDTHS * row.width_px, PART * viewport.imageWidth);
  const [u, v] = place.pixel_px;
  lookInto(u, v, field, field);
  if (matchMedia("(pointer: coarse)").matches && zoom() < TOUCH_ZOOM) zoomAt(TOUCH_ZOOM / zoom(), ...toCss(u, v));
  lookAt(within(u, viewport.width, viewport.imageWidth), within(v, viewport.height, viewport.imageHeight));
  const below = document.documentElement.dataset.shape === "tall" ? 0 : BELOW; // there the line is below the image
  pan(0, Math.min(0, viewport.height - below - toCss(u, v)[1]));
  redraw();
  emit("box");
}
