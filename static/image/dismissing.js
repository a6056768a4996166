/** Dismissing a placement that the radar found and that is not the reflector; undo brings it back. */

import { toast } from "../base/notices.js";
import { send } from "../base/socket.js";
import { dismissalOf, isDismissed, isOffered, placementsAt, stampOf, state } from "../base/state.js";

/** The placement of the frame on screen that can be dismissed or offered again. */
function placementHere() {
  const here = placementsAt(state.cursor);
  return here.find(isOffered) ?? here.find(isDismissed);
}

/** Why there is nothing to dismiss; "" if there is. */
export const withoutPlacement = () => (placementHere() ? "" : "No pair is selected, and there is no placement without a click here");

/** The message that dismisses a placement. @param {import("../messages.js").PlacementRow} placement */
export const dismiss = (placement) => ({ type: "placement_dismissed", time: stampOf(placement.frame), position_m: placement.position_radar_m, dismissed: true });

/** Dismiss the placement of this frame, or offer it again. */
export async function dismissHere() {
  const placement = placementHere();
  if (!placement) return;
  const before = dismissalOf(placement);
  const message = before ? { type: "placement_dismissed", time: before.time, position_m: before.position_m, dismissed: false } : dismiss(placement);
  const refusal = await send(message);
  if (refusal) toast(refusal);
}
