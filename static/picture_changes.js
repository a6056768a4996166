/** How much the picture changes, fetched piece by piece: the server compares frames in the background, coarse to fine. */

import { changes } from "./lanes.js";
import { emit, on, state } from "./state.js";

/** @typedef {{seconds: number[], grey_levels: number[], complete: boolean}} PictureChanges */

/** Until all frames are compared, ask this often [ms]. */
const EVERY = 3000;
let timer = 0;

export function startPictureChanges() {
  on(["placements"], () => {
    clearTimeout(timer);
    fetchChanges();
  });
}

async function fetchChanges() {
  if (state.looking || changes.complete) return;
  const ready = state.connected && !state.opening; // the banner says that the server is gone, the status that it is still opening
  const answer = ready ? await fetch("api/picture_changes.json").catch(() => null) : null;
  if (answer?.ok) Object.assign(changes, await answer.json());
  emit("cursor");
  if (!changes.complete && !state.following) timer = window.setTimeout(fetchChanges, EVERY);
}
