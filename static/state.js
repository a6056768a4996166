// @ts-check
/** The state of the page, and its listeners. The session is held by the server; this is what it sent last. */

/** @typedef {import("./messages.js").View} View */
/** @typedef {import("./messages.js").ClickRow} Click */
/** A decoded frame. @typedef {{index: number, bitmap: ImageBitmap, scale: number, width: number, height: number}} Shown */
/** @typedef {"opening"|"recording"|"view"|"progress"|"placements"|"overlay"|"look"|"radar_map"|"candidates"|"shown"|"selected"|"layers"|"connection"|"playing"|"cursor"|"hover"|"theme"|"box"|"grown"|"following"} Topic */

export const state = {
  /** While the recording is being opened. @type {import("./messages.js").Opening|null} */ opening: null,
  /** A preview shown meanwhile; it is not a frame yet, so it cannot be clicked. @type {Omit<Shown, "index">|null} */ preview: null,
  /** @type {import("./messages.js").RecordingNote|null} */ recording: null,
  /** @type {View|null} */ view: null,
  /** @type {import("./messages.js").PlacementRow[]} */ placements: [],
  placementsKnown: false,
  /** @type {import("./messages.js").Overlay|null} */ overlay: null,
  /** Whether the recording has no pictures: it can be looked at from above, but not clicked in. */ looking: false,
  /** The returns of the last seconds. @type {import("./messages.js").RadarLook|null} */ look: null,
  /** @type {import("./messages.js").RadarMap|null} */ radarMap: null,
  /** What is shown without pictures. @type {{trail_s: number, colour: "speed"|"amplitude", map: boolean, whole: boolean}} */
  lookOptions: { trail_s: 2, colour: "amplitude", map: true, whole: true },
  /** The returns that may belong to the selected click. @type {import("./messages.js").PairCandidates|null} */ candidates: null,
  placementSummary: "",
  /** @type {import("./messages.js").Figure[]} */ placementFigures: [],
  /** @type {Shown|null} */ shown: null,
  /** The frame asked for; the one on screen is `shown`. */ cursor: 0,
  /** @type {string|null} */ selected: null,
  playing: false,
  /** How a recording that is still being written goes on; null for others. @type {import("./messages.js").FollowNote|null} */ following: null,
  /** The newest frame is shown as it comes. */ live: false,
  connected: false,
  /** @type {import("./messages.js").Progress|null} */ progress: null,
  /** @type {{u: number, v: number}|null} */ hover: null,
  layers: { returns: true, others: true, ellipses: true, predictions: true },
  /** Seconds of each frame from the first one. @type {Float64Array} */ seconds: new Float64Array(0),
  /** Marks as the user left them, until the server's view has them. @type {Map<string, {u: number, v: number}>} */ local: new Map(),
};

/** @type {Map<string, Set<() => void>>} */
const listeners = new Map();

/** Call `listener` whenever one of the topics changed. @param {Topic[]} topics @param {() => void} listener */
export function on(topics, listener) {
  for (const topic of topics) {
    if (!listeners.has(topic)) listeners.set(topic, new Set());
    /** @type {Set<() => void>} */ (listeners.get(topic)).add(listener);
  }
}

/** Notify the listeners of a topic. @param {Topic} topic */
export function emit(topic) {
  if (topic === "view" || topic === "recording") derived = null;
  for (const listener of listeners.get(topic) ?? []) listener();
}

/**
 * What is derived from the view and the marks as the user left them; made again once either changed.
 * @type {{rows: Click[], byFrame: Map<number, Click>, byId: Map<string, Click>, frames: number[]}|null}
 */
let derived = null;

function drawn() {
  if (derived) return derived;
  const known = state.view?.clicks ?? [];
  let rows = known;
  if (state.local.size) {
    rows = known.map((click) => {
      const local = state.local.get(stampKey(click.image_time));
      return local ? { ...click, u_px: local.u, v_px: local.v } : click;
    });
    const stamps = new Set(known.map((click) => stampKey(click.image_time)));
    for (const [key, place] of state.local) if (!stamps.has(key)) rows.push(placedHere(key, place));
  }
  const frames = rows.map((click) => click.frame).filter((frame) => frame >= 0).sort((a, b) => a - b);
  derived = { rows, byFrame: new Map(rows.map((click) => [click.frame, click])), byId: new Map(rows.map((click) => [click.id, click])), frames };
  return derived;
}

/** The clicks as they should be drawn now; a row that did not change is the same object as before. @returns {Click[]} */
export const clicks = () => drawn().rows;

/** A click that the server has not confirmed yet. @param {string} key @param {{u: number, v: number}} place @returns {Click} */
function placedHere(key, place) {
  const [sec, nanosec] = key.split(".").map(Number);
  return {
    id: "", image_time: { sec, nanosec }, frame: frameOf({ sec, nanosec }), u_px: place.u, v_px: place.v, state: "pending",
    projected_px: null, residual_px: null, ellipse: null, range_m: null, azimuth_deg: null, elevation_deg: null,
    returns: null, outlier_probability: null, note: "",
  };
}

/** @param {import("./messages.js").Stamp} stamp */
export const stampKey = (stamp) => `${stamp.sec}.${stamp.nanosec}`;

/** The stamp of a frame, exactly as recorded. @param {number} index @returns {import("./messages.js").Stamp} */
export function stampOf(index) {
  const times = /** @type {import("./messages.js").RecordingNote} */ (state.recording).frame_times;
  return { sec: times.sec[index], nanosec: times.nanosec[index] };
}

/** @param {import("./messages.js").Stamp} stamp */
function frameOf(stamp) {
  const times = /** @type {import("./messages.js").RecordingNote} */ (state.recording).frame_times;
  return times.sec.findIndex((sec, index) => sec === stamp.sec && times.nanosec[index] === stamp.nanosec);
}

/** The click in a frame. @param {number} index @returns {Click|undefined} */
export const clickIn = (index) => drawn().byFrame.get(index);

/** The selected click. @returns {Click|undefined} */
export const selectedClick = () => (state.selected ? drawn().byId.get(state.selected) : undefined);

/** The placement that includes a frame. @param {number} index @returns {import("./messages.js").PlacementRow|undefined} */
export function placementAt(index) {
  const time = state.seconds[index];
  return state.placements.find((placement) => placement.start_s <= time && time <= placement.end_s);
}

/** Whether a placement has a click. @param {import("./messages.js").PlacementRow} placement */
export function isClicked(placement) {
  const { frames } = drawn();
  let [low, high] = [0, frames.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (state.seconds[frames[middle]] < placement.start_s) low = middle + 1;
    else high = middle;
  }
  return low < frames.length && state.seconds[frames[low]] <= placement.end_s;
}

/** A range that differs this much from the placement's is another target [m]; the reflector's own returns scatter by a few decimetres. */
const APART_M = 0.75;

/** Returns a message if the radar position used for a click is not that of the placement in the timeline, else "". @param {Click} click */
export function rangeApart(click) {
  const placement = placementAt(click.frame);
  if (!placement || click.range_m === null || Math.abs(click.range_m - placement.range_m) < APART_M) return "";
  return `This pair is at ${click.range_m.toFixed(1)} m, but the placement is at ${placement.range_m.toFixed(1)} m`;
}

/** Change the selection. @param {string|null} id */
export function select(id) {
  if (state.selected === id) return;
  state.selected = id;
  emit("selected");
}
