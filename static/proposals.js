// @ts-check
/**
 * Proposals of where the reflector stood, one placement at a time: N goes to the next one, Enter accepts what the picture shows, C
 * takes another place, X says that it is not the reflector, a click puts the mark elsewhere. They are found on the server.
 */

import { boxing } from "./boxes.js";
import { dismiss } from "./dismissing.js";
import { lookAt, lookInto, pan, toCss, viewport, zoom } from "./geometry.js";
import { make, toast } from "./notices.js";
import { fit, marks, redraw } from "./picture.js";
import { goTo, pause } from "./player.js";
import { send } from "./socket.js";
import { emit, isDismissed, isLookedAt, isOffered, on, state } from "./state.js";

/** @typedef {import("./messages.js").ProposalRow} Row */
/** @typedef {import("./messages.js").ProposalPlace} Place */
/** A proposal on screen, and which of its places is taken. @typedef {{row: Row, place: Place, number: number}} Offer */

/** What is shown of the picture around a proposal: so many widths of the reflector, and at least this part of the picture. */
const WIDTHS = 9;
const PART = 0.1;
/** Room below a proposal for the line on the frame, so that it does not cover the reflector [CSS px]. */
const BELOW = 120;
/** Nothing is accepted so soon after a better place was found for what is on screen [ms]: nobody has seen it yet. */
const UNSEEN = 300;
/** A place that moved by less is the same [px]. */
const SAME_PX = 1;

/** The last proposal of each placement: it stays while its placement has a click, since undo takes that back. @type {Map<number, Row>} */
const known = new Map();
/** Placements that were decided here and not confirmed by the server yet. @type {Set<number>} */
const sent = new Set();
/** Those decided here, the last one at the end; undo leads back to it. @type {number[]} */
const decided = [];
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
let moved = -Infinity;
/** Whether the last proposal was decided just now: Enter then means nothing else until another key is pressed, or the pointer. */
let over = false;
/** The switch; made at the start. @type {HTMLButtonElement} */
let chip;

export function startProposals() {
  chip = /** @type {HTMLButtonElement} */ (make("button", "chip", ""));
  chip.dataset.layer = "proposals";
  chip.onclick = (event) => {
    toggleProposals();
    if (event.detail) /** @type {HTMLElement} */ (marks.parentElement).focus({ preventScroll: true }); // Enter is for the picture then
  };
  document.getElementById("layers")?.append(chip);
  drawChip();
  on(["proposals", "recording", "placements"], drawChip);
  on(["shown"], arrive);
  on(["view"], settle);
  on(["playing"], () => state.playing && (awaited = null));
  addEventListener("keydown", (event) => event.key !== "Enter" && (over = false), { capture: true });
  addEventListener("pointerdown", () => (over = false), { capture: true });
}

/** @param {import("./messages.js").ProposalNews} message */
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

/** @param {Place} one @param {Place|undefined} other */
const samePlace = (one, other) => other !== undefined && Math.hypot(one.u_px - other.u_px, one.v_px - other.v_px) < SAME_PX;

/** Whether a placement still waits for a decision. @param {number} placement */
const isOpen = (placement) => !sent.has(placement) && state.placements[placement] !== undefined && isOffered(state.placements[placement]);

/** The proposals that wait for a decision, the most confident first. @returns {Row[]} */
export function openProposals() {
  if (!state.proposals?.on) return [];
  const rows = state.proposals.rows;
  const kept = [...known.values()].filter((row) => !rows.includes(row));
  return [...rows, ...kept].filter((row) => isOpen(row.placement));
}

/** How sure the proposals are that wait for a decision, by the number of their placement. @returns {Map<number, number>} */
export const confidences = () => new Map(openProposals().map(({ placement, confidence }) => [placement, confidence]));

/** The proposal on screen: that which N went to, or else the most confident one of the frame. @returns {Offer|null} */
export function shownOffer() {
  if (!state.shown || state.playing || state.rectified || boxing.on) return null;
  const seconds = state.seconds[state.shown.index];
  const here = openProposals().filter(({ placement }) => state.placements[placement].start_s <= seconds && seconds <= state.placements[placement].end_s);
  const row = here.find(({ placement }) => placement === current) ?? here[0];
  if (!row) return null;
  const number = Math.min(taken.get(row.placement) ?? 0, row.places.length - 1);
  return { row, place: row.places[number], number };
}

/** How many are decided, how many there are, and which one is on screen. @param {Row} row */
function counted(row) {
  const done = state.placements.filter((placement, index) => sent.has(index) || isDismissed(placement) || isLookedAt(placement)).length;
  const open = openProposals();
  const passed = open.filter(({ placement }) => skipped.has(placement) && placement !== row.placement).length;
  return { number: done + passed + 1, total: done + open.length };
}

/** Go to the proposal that is to be decided next. @returns {boolean} whether there is one */
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

/** The middle of a view of a place, such that the picture fills the view if it can. @param {number} at image px @param {number} box CSS px @param {number} size image px */
function within(at, box, size) {
  const half = box / zoom() / 2;
  return half > size / 2 ? (size - 1) / 2 : Math.min(size - 0.5 - half, Math.max(half - 0.5, at));
}

/** @param {Offer} offer */
function zoomInto({ row, place }) {
  const field = Math.max(WIDTHS * row.width_px, PART * viewport.imageWidth);
  lookInto(place.u_px, place.v_px, field, field);
  lookAt(within(place.u_px, viewport.width, viewport.imageWidth), within(place.v_px, viewport.height, viewport.imageHeight));
  pan(0, Math.min(0, viewport.height - BELOW - toCss(place.u_px, place.v_px)[1]));
  redraw();
  emit("box");
}

/** Whether a better place was found a moment ago for what is on screen. */
export const justMoved = () => performance.now() - moved < UNSEEN;

/** Whether Enter is about proposals: one is on screen, or the last one was decided just now. */
export const takesEnter = () => shownOffer() !== null || (over && !openProposals().length);

/** Enter: what the picture shows becomes a mark, and the next proposal is shown. */
export async function acceptProposal() {
  const offer = shownOffer();
  if (!offer) return void (over && sayOver());
  if (justMoved()) return toast("A better place was just found: look again.");
  const { u_px, v_px, sigma_px } = offer.place;
  await decide(offer.row, { type: "click_placed", image_time: offer.row.image_time, pixel_px: [u_px, v_px], mark: "snapped", sigma_px });
}

/** X: it is not the reflector. */
export async function rejectProposal() {
  const offer = shownOffer();
  if (!offer) return;
  await decide(offer.row, dismiss(state.placements[offer.row.placement]));
}

/** @param {Row} row @param {Record<string, any>} message */
async function decide(row, message) {
  sent.add(row.placement);
  decided.push(row.placement);
  if (!nextProposal()) finish();
  const refusal = await send(message);
  if (!refusal) return settle();
  sent.delete(row.placement);
  toast(refusal, "The proposal is offered again.");
  emit("proposals");
}

function finish() {
  current = null;
  over = true;
  fit();
  emit("proposals");
  sayOver();
}

const sayOver = () => toast("All proposals are decided.", state.proposals?.unproposed.length ? "N goes to the placements without a proposal." : "");

/** C: the next place where the reflector may stand. */
export function nextPlace() {
  const offer = shownOffer();
  if (!offer) return;
  taken.set(offer.row.placement, (offer.number + 1) % offer.row.places.length);
  const after = shownOffer();
  if (after) zoomInto(after);
  emit("proposals");
}

/** The server has what was decided; a decision that was undone is shown again. */
function settle() {
  for (const placement of sent) if (state.placements[placement] && !isOffered(state.placements[placement])) sent.delete(placement);
  const last = decided[decided.length - 1];
  if (last === undefined || sent.has(last)) return;
  if (!isOpen(last)) return void closed.add(last);
  if (!closed.delete(last)) return;
  decided.pop();
  const row = openProposals().find(({ placement }) => placement === last);
  if (row) show(row);
}

/** Decided placements that the server's view had as decided. @type {Set<number>} */
const closed = new Set();

/** What is proposed, and what to do, for the line on the frame; null if nothing is. @returns {import("./steps.js").Words|null} */
export function proposalWords() {
  const offer = shownOffer();
  if (!offer) return null;
  const { row, number } = offer;
  const { number: at, total } = counted(row);
  const several = row.places.length > 1;
  const sure = number ? `place ${number + 1} of ${row.places.length}` : surely(row.confidence);
  const why = row.reason && !number ? `: ${row.reason}` : "";
  const head = `Proposal ${at} of ${total}, ${state.placements[row.placement].range_m.toFixed(1)} m away, ${sure}${why}.\n`;
  return [head, { key: "Enter", action: "accept-proposal" }, " accepts it, ", ...(several ? [{ key: "C", action: "next-place" }, ` other place${row.places.length > 2 ? "s" : ""}, `] : []), { key: "X", action: "reject-proposal" }, " no reflector, ", { key: "N", action: "next-proposal" }, " next; or click the inner corner"];
}

/** A probability in words; none is certain. @param {number} confidence */
const surely = (confidence) => (confidence > 0.99 ? "over 99 % sure" : `${Math.round(100 * confidence)} % sure`);

/** Why a placement has no proposal, as a clause; "" if it has one or nothing is known. @param {number} placement */
export const unproposedReason = (placement) => (state.proposals?.on ? (state.proposals.unproposed.find((one) => one.placement === placement)?.reason ?? "") : "");

/** O: propose, or do not. */
export async function toggleProposals() {
  const refusal = await send({ type: "propose", on: !state.proposals?.on });
  if (refusal) toast(refusal);
}

/** How far the proposals are, in one line; "" if they are not being made. */
function progressWords() {
  const news = state.proposals;
  if (!news?.on) return "";
  if (news.problem) return [news.problem, news.hint].filter(Boolean).join(" ");
  if (news.stage === "off") return "Waits for the placements in the radar data.";
  if (news.stage === "looking") return `Looks at the pictures of placement ${Math.min(news.done + 1, news.count)} of ${news.count}.`;
  if (news.stage === "comparing") return `Compares ${news.done} of ${news.count} placements with what was confirmed.`;
  return `${openProposals().length} to decide${news.unproposed.length ? `; for ${news.unproposed.length} nothing can be proposed` : ""}.`;
}

function drawChip() {
  const news = state.proposals;
  const busy = news?.on && (news.stage === "looking" || news.stage === "comparing");
  chip.hidden = !news || state.looking;
  chip.setAttribute("aria-pressed", String(Boolean(news?.on)));
  chip.classList.toggle("troubled", Boolean(news?.on && news.problem));
  chip.replaceChildren(make("kbd", "", "O"), busy ? `Proposals ${news.done}/${news.count}` : news?.on && news.problem ? "Proposals: none" : "Proposals");
  chip.dataset.hint = ["Proposes where the reflector stood: the radar says when, the picture shows where. Nothing counts before it is accepted. (O)", progressWords()].filter(Boolean).join("\n");
}
