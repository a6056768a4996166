/** What is said of proposals: the line on the frame, how far they are, why there are none; and their switch, a chip among the layers. */

import { attemptFirst, register, withImages } from "../base/actions.js";
import { addLayer } from "../base/layers.js";
import { make, toast } from "../base/notices.js";
import { send } from "../base/socket.js";
import { isOffered, on, state } from "../base/state.js";
import { marks } from "../image/image.js";
import { drawProposal } from "./marks.js";
import { acceptProposal, heldBack, isSearching, nextPlace, nextProposal, openProposals, previousProposal, rejectProposal, saidWords, say, shownOffer, takesEnter, takesKeys } from "./proposals.js";

/** A key and what it does; with an action it can be pressed here too, a pair or a frame is gone to, and an option opened. @typedef {{key: string, label: string, action?: string, pair?: string, frame?: number, option?: string}} Key */
/** Text with keys in between. @typedef {(string|Key)[]} Words */

/** So many clicks show what the reflector looks like, where the images alone propose nothing. */
const FIRST = 2;

/** How many placements wait; nothing while they are being searched for. */
const leftWords = () => (isSearching() ? "" : ` (${state.placements.filter(isOffered).length} left)`);

/** N found no proposal: say why, if that is not because all are decided. */
function sayNone() {
  const news = state.proposals;
  if (!news?.on) return;
  if (news.progress.problem) say(["No proposals.", news.progress.problem, news.progress.hint].filter(Boolean).join(" "));
}

/** What N does. */
export const proposalAdvice = () => `${state.view?.clicks.length ? "Next" : "First"} placement${leftWords()}`;

/** What is proposed, and what to do, for the line on the frame; null if nothing is. @returns {Words|null} */
export function proposalWords() {
  const waiting = heldBack();
  if (waiting) return [`${waiting}; sent when the server is back`];
  const offer = shownOffer();
  if (!offer) return null;
  const { row, number } = offer;
  const sure = number ? `spot ${number + 1} of ${row.places.length}` : surely(row.confidence);
  const why = row.reason && !number ? `, ${row.reason}` : "";
  return [
    `${saidWords()} ${placementWords(row.placement)} · ${sure}${why}`.trim(),
    { key: "Enter", label: "accept", action: "place-mark" },
    ...(row.places.length > 1 ? [{ key: "C", label: "other spot", action: "next-candidate" }] : []),
    { key: "X", label: "no reflector", action: "exclude" },
    { key: "N", label: `next${leftWords()}`, action: "next-placement" },
  ];
}

/** Which placement it is. @param {number} index */
export const placementWords = (index) => `Placement ${index + 1} of ${state.placements.length} · ${state.placements[index].range_m.toFixed(1)} m`;

/** A probability in words; none is certain. @param {number} confidence */
const surely = (confidence) => `${Math.min(99, Math.round(100 * confidence))} % sure`;

/** Why a placement has no proposal, as a sentence; "" if it has one or nothing is known. @param {number} placement */
export function silentWords(placement) {
  const news = state.proposals;
  if (!news?.on) return "";
  if (isSearching()) return ""; // the status line says so
  const reason = news.unproposed.find((one) => one.placement === placement)?.reason;
  if (reason && !news.rows.length && (state.view?.clicks.length ?? 0) < FIRST) return "No proposals yet: click the first two placements yourself.";
  return reason ? `Nothing found here: ${reason}.` : "";
}

/** How far the proposals are, in one line; "" if they are not being made. */
function progressWords() {
  const news = state.proposals;
  if (!news?.on) return "";
  if (news.progress.problem) return [news.progress.problem, news.progress.hint].filter(Boolean).join(" ");
  if (news.progress.stage === "off") return "Waits for the placements in the radar data.";
  if (news.progress.stage === "looking") return `Looks at the images of placement ${Math.min(news.progress.done + 1, news.progress.count)} of ${news.progress.count}.`;
  if (news.progress.stage === "comparing") return `Compares ${news.progress.done} of ${news.progress.count} placements with what was confirmed.`;
  return `${openProposals().length} to decide${news.unproposed.length ? `; for ${news.unproposed.length} nothing can be proposed` : ""}.`;
}

/** Made at the start. @type {HTMLButtonElement} */
let chip;

export function startSwitch() {
  addLayer("proposal", drawProposal);
  register({ id: "proposals", group: "Mark", words: "Proposals on or off", keys: ["O"], also: "automatic find suggestions off on switch", run: toggleProposals, when: withImages });
  attemptFirst("next-placement", () => nextProposal() || (sayNone(), false));
  attemptFirst("previous-placement", previousProposal);
  attemptFirst("place-mark", () => takesEnter() && !state.cross && (acceptProposal(), true));
  attemptFirst("next-candidate", () => takesKeys() && (nextPlace(), true), takesKeys);
  attemptFirst("exclude", () => takesKeys() && (rejectProposal(), true), takesKeys);
  chip = /** @type {HTMLButtonElement} */ (make("button", "chip", ""));
  chip.dataset.layer = "proposals";
  chip.onclick = (event) => {
    toggleProposals();
    if (event.detail) /** @type {HTMLElement} */ (marks.parentElement).focus({ preventScroll: true }); // Enter is for the image then
  };
  document.getElementById("layers")?.append(chip);
  drawChip();
  on(["proposals", "recording", "placements"], drawChip);
}

/** O: propose, or do not. */
async function toggleProposals() {
  const refusal = await send({ type: "propose", on: !state.proposals?.on });
  if (refusal) toast(refusal);
}

function drawChip() {
  const news = state.proposals;
  const busy = news?.on && (news.progress.stage === "looking" || news.progress.stage === "comparing");
  chip.hidden = !news || state.looking;
  chip.setAttribute("aria-pressed", String(Boolean(news?.on)));
  chip.classList.toggle("troubled", Boolean(news?.on && news.progress.problem));
  chip.replaceChildren(make("kbd", "", "O"), busy ? `Proposals ${news.progress.done}/${news.progress.count}` : news?.on && news.progress.problem ? "Proposals: none" : "Proposals");
  chip.dataset.hint = ["Proposes where the reflector stood: the radar says when, the image shows where. Proposals count once you accept them. (O)", progressWords()].filter(Boolean).join("\n");
}
