/** The warnings: one line each, the gravest first; one unfolds to its whole message and what to do about it. */

import { showTab } from "./layout.js";
import { openMeanings } from "./meanings.js";
import { icon, make, toast } from "./notices.js";
import { send } from "./socket.js";
import { state } from "./state.js";

/** @typedef {import("./messages.js").WarningRow} WarningRow */
/** @typedef {import("./messages.js").AssumptionRow} AssumptionRow */
const box = /** @type {HTMLElement} */ (document.getElementById("warnings"));
/** What the user has unfolded stays so. @type {Set<string>} */
const openCodes = new Set(["unsolvable", "no-camera", "assumed", "calibration-ambiguous"]);
/** What is no warning of a calibration, but why there is none. */
const NOT_TO_ACKNOWLEDGE = ["unsolvable", "no-camera"];
/** What leaves open what a calibration means: a person picks. */
const TO_PICK = ["calibration-ambiguous", "calibration-picked"];
/** What speaks of the lens. */
const OF_THE_LENS = ["intrinsics-suspected", "lens-or-radar-scale"];
let drawn = "";

/**
 * @param {WarningRow[]} ofPose about the calibration, the gravest first
 * @param {WarningRow[]} ofRecording
 * @param {AssumptionRow[]} assumptions
 * @param {string[]} acknowledged codes of the warnings that the user has read
 */
export function drawWarnings(ofPose, ofRecording, assumptions, acknowledged) {
  const text = JSON.stringify([ofPose, ofRecording, assumptions, acknowledged]);
  if (text === drawn) return;
  drawn = text;
  const all = [...ofPose.map((warning) => ({ warning, kind: "" })), ...ofRecording.map((warning) => ({ warning, kind: "note" }))];
  const read = all.filter(({ warning }) => acknowledged.includes(warning.code));
  const unread = all.filter(({ warning }) => !acknowledged.includes(warning.code));
  const total = unread.length + (assumptions.length ? 1 : 0);
  if (!total && !read.length) return box.replaceChildren();
  const held = document.activeElement?.closest("#warnings [data-code]")?.getAttribute("data-code");
  const ofThePose = unread.filter(({ kind }) => !kind);
  const rows = make("div", "rows", [
    ...ofThePose.map(({ warning, kind }) => row(warning, kind, false)),
    ...(assumptions.length ? [assumptionBox(assumptions)] : []),
    ...unread.filter(({ kind }) => kind).map(({ warning, kind }) => row(warning, kind, false)),
    ...(read.length ? [folded("acknowledged", "acknowledged", `${read.length} acknowledged`, read.map(({ warning, kind }) => row(warning, kind, true)))] : []),
  ]);
  const count = make("div", "count", `${total} warnings, the gravest first`);
  box.replaceChildren(...(total > 1 ? [count] : []), rows);
  if (held) /** @type {HTMLElement|null} */ (box.querySelector(`[data-code="${CSS.escape(held)}"] > summary`))?.focus({ preventScroll: true });
}

/** @param {WarningRow} warning @param {string} kind @param {boolean} read */
function row(warning, kind, read) {
  /** @type {HTMLElement[]} */
  const inside = [make("div", "hint", warning.hint)];
  if (TO_PICK.includes(warning.code)) {
    const pick = make("button", "pick", "Pick a meaning…");
    pick.onclick = openMeanings;
    inside.push(pick);
  }
  if (OF_THE_LENS.includes(warning.code) || (warning.code === "unsolvable" && state.lens && !state.lens.intrinsics)) {
    const open = make("button", "pick", "Open the tab Lens");
    open.onclick = () => showTab("tab-lens");
    inside.push(open);
  }
  if (!NOT_TO_ACKNOWLEDGE.includes(warning.code)) {
    const button = make("button", "acknowledge", read ? "Show again" : "Acknowledge");
    button.onclick = async () => {
      const refusal = await send({ type: "warnings_acknowledged", codes: [warning.code], acknowledged: !read });
      if (refusal) toast(refusal);
    };
    inside.push(button);
  }
  return folded(warning.code, `warning ${kind}`, warning.message, inside);
}

/** A line that unfolds. @param {string} code @param {string} className @param {string} line @param {HTMLElement[]} inside */
function folded(code, className, line, inside) {
  const made = make("details", className.trim(), [make("summary", "", [icon("warning"), make("span", "", line)]), ...inside]);
  made.dataset.code = code;
  made.open = openCodes.has(code);
  made.ontoggle = () => (made.open ? openCodes.add(code) : openCodes.delete(code));
  return made;
}

/** What the recording does not state, with a button that confirms all of it. @param {AssumptionRow[]} rows */
function assumptionBox(rows) {
  const confirm = make("button", "", "Confirm");
  confirm.id = "confirm-assumptions";
  confirm.onclick = async () => {
    const refusal = await send({ type: "assumptions_confirmed", texts: rows.map((one) => one.text) });
    if (refusal) toast(refusal);
  };
  const title = rows.length === 1 ? "One assumption about the recording is unconfirmed" : `${rows.length} assumptions about the recording are unconfirmed`;
  const items = rows.map((one) => make("li", "", [one.words, make("div", "hint", one.hint)]));
  return folded("assumed", "warning", title, [confirm, make("ul", "", items)]);
}
