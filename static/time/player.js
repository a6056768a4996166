/**
 * Which frame is on the screen: stepping, playing, the requests for frames (few in flight, the newest wins), and the newest frame of a
 * recording that is still being written.
 */

import { opened, register } from "../base/actions.js";
import { requestNumber, tell } from "../base/socket.js";
import { clicks, emit, on, select, state } from "../base/state.js";

const KEPT = 12;
const withFrames = () => opened() || (state.seconds.length > 1 ? "" : "There is only one frame");
const FRAMES = { help: "Step one frame", when: withFrames };
const TENS = { help: "Step ten frames", when: withFrames };
const ENDS = { help: "First or last frame", when: withFrames };
/** Maximum number of requests in flight while playing. */
const CREDIT = 2;
/** @type {Map<number, import("../base/state.js").Shown>} */
const kept = new Map();
let newest = 0;
/** Requests in flight; an answer to one also settles all before it. @type {number[]} */
let coming = [];
let startedAt = 0;
let startedFrom = 0;
let asked = -1;

/** Make the actions of time known. */
export function registerTime() {
  register(
    { id: "play", group: "Time", words: "Play or pause", keys: ["Space"], also: "start stop run video", run: () => (state.playing ? pause() : play()), when: withFrames },
    { id: "frame-back", group: "Time", words: "One frame back", keys: ["ArrowLeft"], also: "previous step", run: () => step(-1), ...FRAMES },
    { id: "frame-forward", group: "Time", words: "One frame forward", keys: ["ArrowRight"], also: "next step", run: () => step(1), ...FRAMES },
    { id: "ten-back", group: "Time", words: "Ten frames back", keys: ["Shift+ArrowLeft"], also: "previous jump rewind", run: () => step(-10), ...TENS },
    { id: "ten-forward", group: "Time", words: "Ten frames forward", keys: ["Shift+ArrowRight"], also: "next jump skip", run: () => step(10), ...TENS },
    { id: "first-frame", group: "Time", words: "Go to the first frame", keys: ["Home"], also: "start beginning", run: () => goTo(0), ...ENDS },
    { id: "last-frame", group: "Time", words: "Go to the last frame", keys: ["End"], also: "finish newest", run: () => goTo(state.seconds.length - 1), ...ENDS },
  );
}

/** Go to a frame. @param {number} index */
export function goTo(index) {
  const last = state.seconds.length - 1;
  if (last < 0) return;
  state.cursor = Math.min(last, Math.max(0, Math.round(index)));
  const ready = kept.get(state.cursor);
  if (ready && (ready.scale === 1 || state.playing)) show(ready);
  else if (!state.looking) request(state.cursor);
  emit("cursor");
  tellCursor();
}

/** Step by recorded frames; stops playing. @param {number} count */
function step(count) {
  pause();
  goTo(state.cursor + count);
}

export function pause() {
  if (!state.playing) return;
  state.playing = false;
  emit("playing");
  goTo(state.cursor);
}

function play() {
  if (state.playing || state.seconds.length < 2) return;
  leaveLive();
  if (state.cursor >= state.seconds.length - 1) state.cursor = 0;
  state.playing = true;
  restart();
  emit("playing");
  requestAnimationFrame(tick);
}

/** Restart the playback clock at the current frame. */
function restart() {
  startedAt = performance.now();
  startedFrom = state.seconds[state.cursor];
  asked = state.cursor;
  coming = [];
}

/** Jump to a frame, whether playing or not. @param {number} index */
export function jump(index) {
  goTo(index);
  if (state.playing) restart();
}

function tick() {
  if (!state.playing) return;
  const time = startedFrom + (performance.now() - startedAt) / 1000;
  const due = indexAt(time);
  if (state.looking) return tickWithoutImages(due);
  if (due > asked && coming.length < CREDIT) {
    asked = due;
    const ready = kept.get(due);
    if (ready) show(ready);
    else request(due);
  }
  if (due >= state.seconds.length - 1 && state.shown?.index === due) return pause();
  requestAnimationFrame(tick);
}

/** The next moment comes once the server has answered for the one before. @param {number} due */
function tickWithoutImages(due) {
  if (due > state.cursor && (state.look?.index ?? -1) >= asked) {
    asked = due;
    goTo(due);
  }
  if (due >= state.seconds.length - 1) return pause();
  requestAnimationFrame(tick);
}

/** The last frame at or before a time. @param {number} time s from the first frame */
function indexAt(time) {
  let [low, high] = [0, state.seconds.length - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (state.seconds[middle] <= time) low = middle;
    else high = middle - 1;
  }
  return low;
}

/** The frame nearest to a time. @param {number} time s from the first frame */
export function nearestIndex(time) {
  const index = indexAt(time);
  const next = Math.min(index + 1, state.seconds.length - 1);
  return time - state.seconds[index] <= state.seconds[next] - time ? index : next;
}

/** @param {number} index */
function request(index) {
  newest = requestNumber();
  const size = state.rectified ? "rectified" : state.playing ? "half" : "full";
  const sent = tell({ type: "frame", index, request: newest, playing: state.playing, size });
  if (sent) coming.push(newest);
}

/** Request the current frame again: after a reconnection, or rectified in another way. */
export function requestAgain() {
  coming = [];
  kept.clear();
  if (state.playing) restart();
  if (!state.looking) request(state.cursor);
  tellCursor();
}

/** Take a frame that has arrived. @param {any} header @param {Uint8Array<ArrayBuffer>} data */
export async function receiveFrame(header, data) {
  if (header.index < 0) return receivePreview(header, data);
  coming = coming.filter((request) => request > header.request);
  const isMoving = () => state.playing || state.live;
  if (header.request < newest && !isMoving()) return;
  const shown = { index: header.index, ...(await decoded(header, data)) };
  if (shown.rectified !== state.rectified) return shown.bitmap.close();
  keep(shown);
  const newer = isMoving() && header.index > (state.shown?.index ?? -1);
  const again = state.playing && header.request === newest; // playing from the start again
  if (newer || again || header.index === state.cursor) show(kept.get(header.index) ?? shown);
}

/** Take an image that has arrived before the recording is open. @param {any} header @param {Uint8Array<ArrayBuffer>} data */
async function receivePreview(header, data) {
  const preview = await decoded(header, data);
  if (state.shown) return preview.bitmap.close();
  state.preview = preview;
  emit("opening");
}

/** @param {any} header @param {Uint8Array<ArrayBuffer>} data */
async function decoded(header, data) {
  const blob = new Blob([data], { type: `image/${header.format}` });
  const bitmap = await createImageBitmap(blob, { colorSpaceConversion: "none", premultiplyAlpha: "none" });
  return { bitmap, scale: header.scale, width: header.width_px, height: header.height_px, rectified: header.rectified };
}

/** Note that a frame could not be read. @param {number|null} request */
export function frameFailed(request) {
  coming = coming.filter((number) => request === null || number > request);
}

/** @param {import("../base/state.js").Shown} shown */
function keep(shown) {
  const before = kept.get(shown.index);
  if (before && before.scale > shown.scale) return;
  kept.delete(shown.index);
  kept.set(shown.index, shown);
  for (const [index, old] of kept) {
    if (kept.size <= KEPT) break;
    kept.delete(index);
    if (old.bitmap !== state.shown?.bitmap) old.bitmap.close();
  }
}

/** @param {import("../base/state.js").Shown} shown */
function show(shown) {
  state.shown = shown;
  if (state.playing) {
    state.cursor = shown.index;
    emit("cursor");
    tellCursor();
  }
  selectHere(shown.index);
  emit("shown");
}

/** Select the click of the frame on screen. @param {number} index */
function selectHere(index) {
  const here = clicks().find((click) => click.frame === index && click.id !== "");
  if (here) select(here.id);
  else if (!state.playing) select(null);
}

/** What another room tells the server with every cursor. @type {() => Partial<import("../messages.js").CursorMoved>} */
let added = () => ({});

/** @param {typeof added} part */
export const addToCursor = (part) => void (added = part);

/** Tell the server which frame this tab shows; it answers with the overlay and updates the 3D view. */
export function tellCursor() {
  tell({ type: "cursor", index: state.cursor, playing: state.playing, selected: state.selected, light: document.documentElement.dataset.theme === "light", ...added() });
}

const button = /** @type {HTMLButtonElement} */ (document.getElementById("live"));
/** A frame that takes longer than this to come is not waited for [ms]. */
const PATIENCE = 1500;
let moving = false;
/** Whether the newest frame was shown once; a note may come before the frames are known. */
let begun = false;
let askedAt = 0;
/** The cursor at its last event. */
let seen = -1;

export function startLive() {
  register({ id: "live", group: "Time", words: "Show the newest frame as it comes", also: "live follow recording now", run: goLive, when: () => (follows() ? "" : "The recording is complete: no new frames come") });
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
function goLive() {
  if (state.playing) pause(); // else the frame that is due would take the newest one's place
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

/** @param {import("../messages.js").FollowNote} note */
export function takeFollowing(note) {
  state.following = note;
  if (!begun && follows() && state.seconds.length) {
    begun = true;
    return goLive();
  }
  if (!follows()) state.live = false;
  emit("following");
}

/** Add frames after those known; with a gap between, greet again to get all of them. @param {import("../messages.js").FramesAdded} added */
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
