/** The state of the page, its listeners, and how a change of the View is applied. The session is held by the server; this is what it sent last. */

/** @typedef {import("../messages.js").View} View */
/** @typedef {import("../messages.js").ClickRow} Click */
/** A decoded frame. @typedef {{index: number, bitmap: ImageBitmap, scale: number, width: number, height: number, rectified: boolean}} Shown */
/** @typedef {"opening"|"recording"|"view"|"progress"|"placements"|"overlay"|"look"|"radar_map"|"shown"|"selected"|"layers"|"connection"|"playing"|"cursor"|"hover"|"theme"|"box"|"grown"|"following"|"candidates"|"cross"|"lens"|"proposals"|"lanes"} Topic */

export const state = {
  /** While the recording is being opened. @type {import("../messages.js").Opening|null} */ opening: null,
  /** A preview shown meanwhile; it is not a frame yet, so it cannot be clicked. @type {Omit<Shown, "index">|null} */ preview: null,
  /** @type {import("../messages.js").RecordingNote|null} */ recording: null,
  /** @type {View|null} */ view: null,
  /** @type {import("../messages.js").PlacementRow[]} */ placements: [],
  placementsKnown: false,
  /** @type {import("../messages.js").Overlay|null} */ overlay: null,
  /** Whether the recording has no images: it can be looked at from above, but not clicked in. */ looking: false,
  /** The returns of the last seconds. @type {import("../messages.js").RadarFrame|null} */ look: null,
  /** @type {import("../messages.js").RadarMap|null} */ radarMap: null,
  /** What is shown without images. @type {{trail_s: number, colour: "speed"|"amplitude", map: boolean, whole: boolean}} */
  lookOptions: { trail_s: 2, colour: "amplitude", map: true, whole: true },
  placementSummary: "",
  /** @type {import("../messages.js").Figure[]} */ placementFigures: [],
  /** @type {Shown|null} */ shown: null,
  /** The frame asked for; the one on screen is `shown`. */ cursor: 0,
  /** @type {string|null} */ selected: null,
  playing: false,
  /** How a recording that is still being written goes on; null for others. @type {import("../messages.js").FollowNote|null} */ following: null,
  /** The newest frame is shown as it comes. */ live: false,
  connected: false,
  /** @type {import("../messages.js").Progress|null} */ progress: null,
  /** @type {{u: number, v: number}|null} */ hover: null,
  layers: { returns: true, others: true, ellipses: true, predictions: true },
  /** Seconds of each frame from the first one. @type {Float64Array} */ seconds: new Float64Array(0),
  /** Marks as the user left them, until the server's view has them: by the click's id, or a name for one that is new. @type {Map<string, Draft>} */ local: new Map(),
  /** The returns that may belong to the selected click. @type {import("../messages.js").PairCandidates|null} */ candidates: null,
  /** Where the reflector probably stood, and how far finding that is. @type {import("../messages.js").ProposalNews|null} */ proposals: null,
  /** The intrinsics in use, and how far a calibration of the lens is. @type {import("../messages.js").LensState|null} */ lens: null,
  /** Whether frames are shown without distortion. */ rectified: false,
  /** The cross of the keyboard, while it is used. @type {Cross|null} */ cross: null,
};

/** @typedef {{u: number, v: number, image_time?: import("../messages.js").Stamp, mark?: import("../messages.js").ClickRow["mark"]}} Draft A mark that the server does not have yet; a new one has a time. */
/** A field of the image, by its centre and size [px]. @typedef {{u: number, v: number, wide: number, high: number}} Field */
/** @typedef {{frame: number, u: number, v: number, touched: boolean, expected: boolean, fields: Field[]}} Cross `fields` from the widest to the present one */

/** @type {Map<string, Set<() => void>>} */
const listeners = new Map();

/** Call `listener` whenever one of the topics changed. @param {Topic[]} topics @param {() => void} listener */
export function on(topics, listener) {
  for (const topic of topics) {
    if (!listeners.has(topic)) listeners.set(topic, new Set());
    /** @type {Set<() => void>} */ (listeners.get(topic)).add(listener);
  }
}

/** Listeners that wait for the next image. @type {Set<() => void>} */
const waiting = new Set();

/** The same, once for all changes until the next image is painted: a mark does not wait for a table. @param {Topic[]} topics @param {() => void} listener */
export function onPainted(topics, listener) {
  on(topics, () => {
    if (!waiting.size) requestAnimationFrame(() => setTimeout(callWaiting));
    waiting.add(listener);
  });
}

function callWaiting() {
  const now = [...waiting];
  waiting.clear();
  for (const listener of now) listener();
}

/** Notify the listeners of a topic. @param {Topic} topic */
export function emit(topic) {
  if (topic === "view" || topic === "recording") derived = null;
  if (topic === "placements" || !derived) names = null;
  for (const listener of listeners.get(topic) ?? []) listener();
}

/**
 * What is derived from the view and the marks as the user left them; made again once either changed.
 * @type {{rows: Click[], byFrame: Map<number, Click[]>, byPlacement: Map<number, Click[]>, byId: Map<string, Click>}|null}
 */
let derived = null;

function drawn() {
  if (derived) return derived;
  const known = state.view?.clicks ?? [];
  let rows = known;
  if (state.local.size) {
    rows = known.map((click) => {
      const local = state.local.get(click.id);
      return local ? { ...click, u_px: local.u, v_px: local.v } : click;
    });
    for (const draft of state.local.values()) if (draft.image_time) rows.push(placedHere(draft.image_time, draft));
  }
  derived = { rows, byFrame: grouped(rows, "frame"), byPlacement: grouped(rows, "placement"), byId: new Map(rows.map((click) => [click.id, click])) };
  return derived;
}

/** @param {Click[]} rows @param {"frame"|"placement"} by @returns {Map<number, Click[]>} */
function grouped(rows, by) {
  /** @type {Map<number, Click[]>} */
  const groups = new Map();
  for (const click of rows) (groups.get(click[by]) ?? groups.set(click[by], []).get(click[by]))?.push(click);
  return groups;
}

/** The clicks as they should be drawn now; a row that did not change is the same object as before. @returns {Click[]} */
export const clicks = () => drawn().rows;

/** A click that the server has not confirmed yet. @param {import("../messages.js").Stamp} image_time @param {Draft} draft @returns {Click} */
function placedHere(image_time, draft) {
  const mark = draft.mark ?? "clicked";
  return {
    id: "", image_time, frame: frameOf(image_time), u_px: draft.u, v_px: draft.v, state: mark === "untouched" ? "untouched" : "pending",
    projected_px: null, residual_px: null, ellipse: null, range_m: null, azimuth_deg: null, elevation_deg: null,
    returns: null, outlier_probability: null, note: "", mark, sigma_px: null, chosen: false, placement: -1,
  };
}

/** @param {import("../messages.js").Stamp} stamp */
export const stampKey = (stamp) => `${stamp.sec}.${stamp.nanosec}`;

/** The stamp of a frame, exactly as recorded. @param {number} index @returns {import("../messages.js").Stamp} */
export function stampOf(index) {
  const times = /** @type {import("../messages.js").RecordingNote} */ (state.recording).frame_times;
  return { sec: times.sec[index], nanosec: times.nanosec[index] };
}

/** @param {import("../messages.js").Stamp} stamp */
function frameOf(stamp) {
  const times = /** @type {import("../messages.js").RecordingNote} */ (state.recording).frame_times;
  return times.sec.findIndex((sec, index) => sec === stamp.sec && times.nanosec[index] === stamp.nanosec);
}

/** The clicks in a frame. @param {number} index @returns {Click[]} */
export const clicksIn = (index) => drawn().byFrame.get(index) ?? [];

/** The click in a frame that keys act on: the selected one, or else the first. @param {number} index @returns {Click|undefined} */
export function clickIn(index) {
  const here = clicksIn(index);
  return here.find((click) => click.id !== "" && click.id === state.selected) ?? here[0];
}

/** The selected click. @returns {Click|undefined} */
export const selectedClick = () => (state.selected ? drawn().byId.get(state.selected) : undefined);

/** @typedef {import("../messages.js").PlacementRow} Placement */

/** The placements that include a frame: several, if several reflectors stood at once. @param {number} index @returns {Placement[]} */
export function placementsAt(index) {
  const time = state.seconds[index];
  return state.placements.filter((placement) => placement.start_s <= time && time <= placement.end_s);
}

/** The placement that includes a frame: one that still wants a click, if there is one. @param {number} index @returns {Placement|undefined} */
export function placementAt(index) {
  const here = placementsAt(index);
  return here.find(isOffered) ?? here.find((placement) => !isDismissed(placement)) ?? here[0];
}

/** The clicks of a placement, as far as that is known. @param {Placement} placement @returns {Click[]} */
export const clicksOf = (placement) => drawn().byPlacement.get(state.placements.indexOf(placement)) ?? [];

/** What clicks with an id are called. @type {Map<string, string>|null} */
let names = null;

/** What a click is called on the page: the number of its placement, with a letter if there are several; its id where there is no placement. @param {string} id @returns {string} */
export function nameOf(id) {
  if (!names) {
    const found = (names = new Map());
    state.placements.forEach((placement, index) => {
      const own = clicksOf(placement);
      own.forEach((click, place) => found.set(click.id, `${index + 1}${own.length > 1 ? String.fromCharCode(97 + (place % 26)) : ""}`));
    });
  }
  return names.get(id) ?? id;
}

/** Whether a recording has many minutes: its times are minutes then. @param {number} last its last second */
export const isLong = (last) => last >= 600;

/** A time of the recording, as the ruler says it. @param {number} seconds @param {number} digits */
export function timeText(seconds, digits) {
  return isLong(state.seconds.at(-1) ?? 0) ? minutesText(seconds, digits) : `${seconds.toFixed(digits)} s`;
}

/** @param {number} seconds @param {number} digits */
export function minutesText(seconds, digits) {
  const unit = 10 ** digits;
  const parts = Math.floor(seconds * unit + 1e-6);
  const [hours, minutes] = [Math.floor(parts / unit / 3600), Math.floor(parts / unit / 60) % 60];
  const rest = ((parts % (60 * unit)) / unit).toFixed(digits).padStart(digits ? digits + 3 : 2, "0");
  return hours ? `${hours}:${String(minutes).padStart(2, "0")}:${rest}` : `${minutes}:${rest}`;
}

/** Three significant digits. @param {number} value */
export const digits = (value) => (value < 0.995 ? value.toFixed(2) : value < 999.5 ? value.toPrecision(3) : value.toFixed(0));

/** A residual: as many decimals as the server sends, one from 1 px on. @param {number} value px */
export const residualText = (value) => `${value < 0.995 ? value : value < 99.95 ? value.toFixed(1) : digits(value)} px`;

/** What a click is called within a sentence. @param {string} id */
export const called = (id) => (nameOf(id) === id ? id : `#${nameOf(id)}`);

/** Words of the server as text: clicks are called as on the page, options by their labels. @param {import("../messages.js").Words} words */
export const said = ({ parts }) => parts.map((part) => (typeof part === "string" ? part : "pair" in part ? called(part.pair) : optionWords(part))).join("");

/** @param {import("../messages.js").OptionPart} option */
function optionWords({ option, value }) {
  const field = (state.recording?.option_groups ?? []).flatMap((group) => group.options).find(({ path }) => path === option);
  if (!field) return `--${option.replaceAll("_", "-")} ${value}`.trim(); // how the recording is read is said when it is opened
  return value ? `${field.label} ${value}` : field.label;
}

/** Whether a placement has a click, also one that is excluded or does not count. @param {Placement} placement */
export const isClicked = (placement) => clicksOf(placement).length > 0;

/** Whether the user said that a placement is not the reflector. @param {Placement} placement */
export const isDismissed = (placement) => dismissalOf(placement) !== undefined;

/** Positions of one placement differ less than this between two surveys of a recording [m]. */
const SAME_M = 0.5;

/** The dismissal of a placement. @param {Placement} placement */
export function dismissalOf(placement) {
  const start = state.recording?.start ?? { sec: 0, nanosec: 0 };
  return state.view?.dismissed.find(({ time, position_m }) => {
    const seconds = time.sec - start.sec + (time.nanosec - start.nanosec) * 1e-9;
    const away = Math.hypot(...position_m.map((value, axis) => value - placement.position_radar_m[axis]));
    return placement.start_s - 0.001 <= seconds && seconds <= placement.end_s + 0.001 && away < SAME_M;
  });
}

/** What became of a placement. @param {Placement} placement */
export const stateOf = (placement) => state.view?.placements[state.placements.indexOf(placement)] ?? "open";

/** Whether a placement still wants a click; while one of its time is on its way, it does not. @param {Placement} placement */
export const isOffered = (placement) => stateOf(placement) === "open" && !onTheWay().some((seconds) => placement.start_s <= seconds && seconds <= placement.end_s);

/** When the clicks were, of which it is not known yet which placement they are of. */
const onTheWay = () => (drawn().byPlacement.get(-1) ?? []).filter((click) => !click.id || click.state === "pending").map((click) => state.seconds[click.frame]);

/** Change the selection. @param {string|null} id */
export function select(id) {
  if (state.selected === id) return;
  state.selected = id;
  emit("selected");
}

/** Return the View after a change; a row that does not change stays the same object. @param {View} view @param {import("../messages.js").ViewChange} change @returns {View} */
function changed(view, change) {
  const clicks = change.clicks ? changedRows(view.clicks, change.clicks) : view.clicks;
  return /** @type {View} */ ({ ...view, ...change.fields, clicks });
}

/** @param {Click[]} rows @param {import("../messages.js").ClickChange} change @returns {Click[]} */
function changedRows(rows, change) {
  const next = change.removed.length || change.added.length ? moved(rows, change) : [...rows];
  const copied = new Set(change.added);
  for (const { rows: given, fields } of change.values) {
    const places = given ?? next.keys();
    let column = 0;
    for (const place of places) {
      if (!copied.has(place)) next[place] = { ...next[place] };
      copied.add(place);
      for (const name in fields) Object.assign(next[place], { [name]: fields[name][column] });
      column += 1;
    }
  }
  return next;
}

/** Remove rows, and make room for those that are added. @param {Click[]} rows @param {import("../messages.js").ClickChange} change @returns {Click[]} */
function moved(rows, change) {
  const gone = new Set(change.removed);
  const kept = rows.filter((_, place) => !gone.has(place));
  const added = new Set(change.added);
  let from = 0;
  return Array.from({ length: kept.length + added.size }, (_, place) => (added.has(place) ? /** @type {Click} */ ({}) : kept[from++]));
}

/** Follows the View that the server sends, and notices a change that is missing. */
export class Follower {
  /** @type {View|null} */ view = null;
  /** Changes since the last whole View. */ changes = 0;

  /** Take a whole View. @param {View} view */
  take(view) {
    this.view = view;
    this.changes = 0;
  }

  /** Take a change. @param {import("../messages.js").ViewChange} change @returns {boolean} false if one before it is missing: a whole View is needed */
  follow(change) {
    if (!this.view || change.number !== this.changes + 1) return false;
    this.view = changed(this.view, change);
    this.changes += 1;
    return true;
  }
}
