/** Following a recording that is still being written: its new frames, and whether the page shows the newest one. */

import { goTo } from "./player.js";
import { tell } from "./socket.js";
import { emit, on, state } from "./state.js";

const button = /** @type {HTMLButtonElement} */ (document.getElementById("live"));
/** A frame that takes longer than this to come is not waited for [ms]. */
const PATIENCE = 1500;
let moving = false;
let askedAt = 0;
/** The cursor at its last event. */
let seen = -1;

export function startLive() {
  button.onclick = goLive;
  on(["following", "cursor", "recording"], drawButton);
  on(["shown"], () => {
    const here = state.cursor === seen; // else the user is about to leave: the cursor's event follows
    if (state.live && here && state.cursor < state.seconds.length - 1) goLive();
  });
  on(["cursor"], () => {
    const moved = state.cursor !== seen;
    seen = state.cursor;
    if (moved && !moving && follows()) state.live = !state.playing && state.cursor === state.seconds.length - 1;
  });
}

/** Whether frames may still come. */
const follows = () => state.following !== null && state.following.state !== "complete" && state.following.state !== "ended";

/** Show the newest frame, and each newer one as it comes. */
export function goLive() {
  state.live = true;
  moving = true;
  askedAt = performance.now();
  goTo(state.seconds.length - 1);
  moving = false;
  emit("following");
}

/** Stay at the frame on screen, because the user works in it. */
export function leaveLive() {
  if (!state.live) return;
  state.live = false;
  emit("following");
}

/** @param {import("./messages.js").FollowNote} note */
export function takeFollowing(note) {
  const first = state.following === null;
  state.following = note;
  if (first && follows() && state.seconds.length) return goLive();
  if (!follows()) state.live = false;
  emit("following");
}

/** Add frames after those known; with a gap between, greet again to get all of them. @param {import("./messages.js").FramesAdded} added */
export function takeFrames(added) {
  const recording = state.recording;
  if (!recording) return;
  const known = state.seconds.length;
  if (added.first > known) return tell({ type: "hello" });
  const { sec, nanosec } = recording.frame_times;
  const from = known - added.first;
  sec.push(...added.frame_times.sec.slice(from));
  nanosec.push(...added.frame_times.nanosec.slice(from));
  const seconds = new Float64Array(sec.length);
  seconds.set(state.seconds);
  for (let index = known; index < sec.length; index += 1) seconds[index] = sec[index] - sec[0] + (nanosec[index] - nanosec[0]) * 1e-9;
  state.seconds = seconds;
  emit("grown");
  const waiting = state.shown?.index !== state.cursor && performance.now() - askedAt < PATIENCE;
  if (state.live && !waiting) goLive();
}

function drawButton() {
  button.hidden = !follows();
  button.setAttribute("aria-pressed", String(state.live));
  const note = state.following;
  button.classList.toggle("quiet", note?.state === "quiet");
  button.dataset.hint = note ? `${note.words}\n${state.live ? "The newest frame is shown as it comes." : "Show the newest frame."}` : "";
}
