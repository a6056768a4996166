/**
 * The header and the status line: recording, clock, buttons, status, progress, the pixel under the pointer. Names are cut in the middle
 * where there is no room, in full on hover.
 */

import { icon, make } from "../base/notices.js";
import { on, onPainted, state, timeText } from "../base/state.js";
import { toDevice, viewport, zoom } from "../image/geometry.js";
import { fit } from "../image/image.js";
import { searchWords } from "../proposals/proposals.js";

/** @param {string} id */
const get = (id) => /** @type {HTMLElement} */ (document.getElementById(id));
/** Buttons that are disabled until the recording is open. */
const NEED_FRAMES = ["play", "step-back", "step-forward", "previous-placement", "next-placement"];
/** A return this close to the pointer is shown in the readout [CSS px]. */
const REACH = 8;

export function startStatus() {
  on(["opening"], drawOpening);
  on(["recording"], drawRecording);
  onPainted(["opening", "view", "connection", "progress", "placements", "following", "proposals"], drawStatus);
  get("zoom").onclick = fit;
  on(["cursor", "shown", "recording", "grown"], drawClock);
  on(["playing"], drawPlay);
  on(["hover", "shown", "box"], drawReadout);
}

function drawOpening() {
  document.body.classList.toggle("opening", state.opening !== null);
  const early = state.opening !== null && !state.recording;
  for (const id of NEED_FRAMES) /** @type {HTMLButtonElement} */ (get(id)).disabled = early;
  if (!early) return;
  setLongName(get("recording-name"), state.opening?.name ?? "");
  document.title = `${state.opening?.name} · cocalib`;
}

function drawRecording() {
  const recording = state.recording;
  if (!recording) return;
  setLongName(get("recording-name"), recording.name);
  get("choose-recording").dataset.hint = `${recording.name}\nHow it is read, its warnings; another recording, other topics, intrinsics or session`;
  const received = recording.sensors.filter(({ clock }) => clock === "receive").map(({ name }) => name); // they include the driver's delay
  get("recording-topics").textContent = received.length ? `receive time: ${received.join(", ")}` : "";
  get("status-right").textContent = `cocalib ${recording.version}`;
  get("status-right").dataset.hint = recording.has_images ? `Every click is saved immediately in\n${recording.session.folder}` : "Nothing is saved: there are no images to click in.";
}

function drawStatus() {
  const view = state.view;
  get("connection").classList.toggle("off", !state.connected);
  get("connection").dataset.hint = state.connected ? "Connected." + (state.looking ? "" : " Every click is saved to disk immediately.") : "Not connected.";
  get("connection").dataset.stage = view?.stage ?? "collecting";
  const opening = state.opening;
  const found = state.looking ? [state.placementSummary].filter(Boolean) : null;
  const words = found?.length ? found : opening || !view ? [opening?.problem || opening?.doing || "Opening the recording…"] : [...followWords(), doingWords(view)].filter(Boolean);
  get("status-text").textContent = words.join("  ·  ");
  get("status-text").dataset.hint = words.join("\n");
  const undo = /** @type {HTMLButtonElement} */ (get("undo"));
  const redo = /** @type {HTMLButtonElement} */ (get("redo"));
  undo.disabled = state.looking || !view?.can_undo;
  redo.disabled = state.looking || !view?.can_redo;
  const progress = state.progress;
  const running = progress !== null && progress.done < progress.total;
  const reading = opening !== null && !opening.problem;
  get("progress").hidden = !running && !reading;
  const bar = /** @type {HTMLProgressElement} */ (get("progress-bar"));
  get("progress-label").textContent = reading ? "" : (progress?.label ?? "");
  if (reading) return bar.removeAttribute("value"); // the remaining time is unknown
  if (!progress || !running) return;
  bar.max = progress.total;
  bar.value = progress.done;
}

/** What is going on: how good the answer is says the verdict, and what to do the line on the frame. @param {import("../messages.js").View} view */
function doingWords(view) {
  if (!state.connected) return "Not connected";
  if (view.solving) return view.checking ? "Checking…" : "Solving…";
  return view.status || searchWords() || "Connected";
}

/** How a recording that is still being written goes on, and where the next placement pays. @returns {string[]} */
function followWords() {
  const note = state.following;
  if (!note) return [];
  return note.state === "complete" || note.state === "ended" ? [note.words] : [note.words, note.advice];
}

function drawClock() {
  const index = state.shown?.index ?? state.cursor;
  get("clock-time").textContent = timeText(state.seconds[index] ?? 0, 3);
  get("clock-frame").textContent = state.seconds.length ? `${index + 1} / ${state.seconds.length}` : "";
}

function drawPlay() {
  const button = get("play");
  button.replaceChildren(icon(state.playing ? "pause" : "play"));
  button.setAttribute("aria-label", state.playing ? "Pause" : "Play");
}

function drawReadout() {
  const point = state.hover;
  const percent = `${Math.round(zoom() * 100)} %`;
  get("zoom").hidden = !state.shown;
  get("zoom").replaceChildren(percent, ...(viewport.fitted ? [] : [make("kbd", "", "F"), make("span", "", "fit")]));
  get("zoom").setAttribute("aria-label", `${percent}: fit the image`);
  const parts = [];
  if (point && !state.playing) parts.push(`u ${point.u.toFixed(1)}  v ${point.v.toFixed(1)}`);
  const near = point ? nearReturn(point) : null;
  if (near) parts.push(near);
  get("readout").textContent = state.shown ? parts.join("   ") : "";
}

/** The radar return under the pointer, as text. @param {{u: number, v: number}} point */
function nearReturn(point) {
  const overlay = state.overlay;
  if (!overlay?.returns || !state.layers.returns || overlay.index !== state.shown?.index) return null;
  const [x, y] = toDevice(point.u, point.v);
  for (const [u, v, range, doppler, snr] of overlay.returns) {
    const [rx, ry] = toDevice(u, v);
    if (Math.hypot(rx - x, ry - y) > REACH * viewport.ratio) continue;
    return [`${range.toFixed(2)} m`, doppler === null ? "" : `${doppler.toFixed(2)} m/s`, snr === null ? "" : `${snr.toFixed(0)} dB`].filter(Boolean).join("  ");
  }
  return null;
}

/** This much of a long name's end always stays: what tells two topics of one sensor apart. */
const KEPT_END = 14;
/** A name of at most this many characters is cut at its end only. */
const SHORT = 28;
/** Right-to-left letters: a name with them is cut at its end only, since parts of mixed directions would change places. */
const RIGHT_TO_LEFT = /[\p{Script=Arabic}\p{Script=Hebrew}\p{Script=Syriac}\p{Script=Thaana}\p{Script=Nko}]/u;

/** Show a name in an element that is there already, and all of it on hover. @param {HTMLElement} owner @param {string} name */
function setLongName(owner, name) {
  owner.classList.add("long-name");
  owner.dir = "auto";
  owner.replaceChildren(...parts(name));
}

/** @param {string} name */
function parts(name) {
  const letters = Array.from(new Intl.Segmenter().segment(name), ({ segment }) => segment); // never within a letter and its accents
  if (letters.length <= SHORT || RIGHT_TO_LEFT.test(name)) return [make("span", "", name)];
  const cut = letters.length - KEPT_END;
  return [make("span", "", letters.slice(0, cut).join("")), make("span", "", letters.slice(cut).join(""))];
}
