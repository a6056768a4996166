/** The switch of the proposals, with how far the search is: a chip among the layers, and the key O. */

import { make, toast } from "./notices.js";
import { marks } from "./picture.js";
import { progressWords } from "./proposal_words.js";
import { send } from "./socket.js";
import { on, state } from "./state.js";

/** Made at the start. @type {HTMLButtonElement} */
let chip;

export function startSwitch() {
  chip = /** @type {HTMLButtonElement} */ (make("button", "chip", ""));
  chip.dataset.layer = "proposals";
  chip.onclick = (event) => {
    toggleProposals();
    if (event.detail) /** @type {HTMLElement} */ (marks.parentElement).focus({ preventScroll: true }); // Enter is for the picture then
  };
  document.getElementById("layers")?.append(chip);
  drawChip();
  on(["proposals", "recording", "placements"], drawChip);
}

/** O: propose, or do not. */
export async function toggleProposals() {
  const refusal = await send({ type: "propose", on: !state.proposals?.on });
  if (refusal) toast(refusal);
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
