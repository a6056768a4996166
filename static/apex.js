/** Asks the server for the reflector's apex near a pixel, in one frame or averaged over those of its placement. */

import { send } from "./socket.js";

/** The server's last answer, until it is used. @type {import("./messages.js").Snapped|null} */
let answer = null;

/** @param {import("./messages.js").Snapped} message */
export function takeSnapped(message) {
  answer = message;
}

/** @param {Omit<import("./messages.js").SnapForm, "type">} wanted @returns {Promise<{found: import("./messages.js").Snapped|null, refusal: string|null|undefined}>} */
export async function askApex(wanted) {
  answer = null;
  const refusal = await send({ type: "snap_wanted", ...wanted });
  return { found: refusal ? null : answer, refusal };
}
