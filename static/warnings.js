// @ts-check
/** The warnings: one line each, the gravest first; one unfolds to its whole message and what to do about it. */

import { icon, make, toast } from "./notices.js";
import { send } from "./socket.js";

/** @typedef {import("./messages.js").WarningRow} WarningRow */
/** @typedef {import("./messages.js").AssumptionRow} AssumptionRow */
const box = /** @type {HTMLElement} */ (document.getElementById("warnings"));
/** What the user has unfolded stays so. @type {Set<string>} */
const openCodes = new Set(["unsolvable", "no-camera", "assumed"]);
let drawn = "";

/**
 * @param {WarningRow[]} ofPose about the calibration, the gravest first
 * @param {WarningRow[]} ofRecording
 * @param {AssumptionRow[]} assumptions
 */
export function drawWarnings(ofPose, ofRecording, assumptions) {
  const text = JSON.stringify([ofPose, ofRecording, assumptions]);
  if (text === drawn) return;
  drawn = text;
  const total = ofPose.length + ofRecording.length + (assumptions.length ? 1 : 0);
  if (!total) return box.replaceChildren();
  const rows = make("div", "rows", [
    ...ofPose.map((warning) => row(warning, "")),
    ...(assumptions.length ? [assumptionBox(assumptions)] : []),
    ...ofRecording.map((warning) => row(warning, "note")),
  ]);
  const count = make("div", "count", total === 1 ? "1 warning" : `${total} warnings, the gravest first`);
  box.replaceChildren(...(total > 1 ? [count] : []), rows);
}

/** @param {WarningRow} warning @param {string} kind */
function row(warning, kind) {
  return folded(warning.code, `warning ${kind}`, warning.message, [make("div", "hint", warning.hint)]);
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
