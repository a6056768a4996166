/** The form that describes the board, remembered from one recording to the next. */

import { make } from "../base/notices.js";

/** What the form says. @typedef {{kind: "checkerboard"|"charuco"|"aprilgrid", size: string, square_mm: number, marker_mm: number, dictionary: string, model: string}} Described */
const KEPT = "cocalib-board";
/** What the fields of each kind of board mean. @type {Record<string, {name: string, size: [string, string], square: [string, string], marker: [string, string]|null}>} */
const KINDS = {
  checkerboard: { name: "Checkerboard", size: ["Inner corners", "Along a row and along a column, such as 9x6 for a board of 10 x 7 squares."], square: ["Square", "Side of a square, measured on the printed board."], marker: null },
  charuco: { name: "ChArUco", size: ["Squares", "Along a row and along a column."], square: ["Square", "Side of a square, measured on the printed board."], marker: ["Marker", "Side of a marker inside a white square."] },
  aprilgrid: { name: "AprilGrid", size: ["Tags", "Along a row and along a column."], square: ["Tag", "Side of a tag, measured on the printed board."], marker: ["Gap", "Distance between the sides of two tags."] },
};
const DICTIONARIES = ["DICT_4X4_50", "DICT_4X4_100", "DICT_5X5_50", "DICT_5X5_100", "DICT_5X5_250", "DICT_6X6_100", "DICT_6X6_250", "DICT_7X7_250", "DICT_ARUCO_ORIGINAL", "DICT_APRILTAG_36h11"];
/** @type {[string, string][]} */
const MODELS = [["auto", "automatic"], ["pinhole", "pinhole"], ["plumb_bob", "plumb_bob"], ["rational_polynomial", "rational"], ["equidistant", "fisheye"]];

/**
 * The form, with what reads it and what shows its problem.
 * @param {() => void} start
 */
export function boardForm(start) {
  const kept = remembered();
  const kind = choice("Kind of board", Object.entries(KINDS).map(([key, { name }]) => [key, name]), kept.kind);
  const model = choice("Lens model", MODELS, kept.model);
  const dictionary = choice("Dictionary of the markers", DICTIONARIES.map((name) => [name, name.replace("DICT_", "")]), kept.dictionary);
  const [size, square, marker] = [entry("Size of the board", kept.size), entry("Side of a square", String(kept.square_mm)), entry("Side of a marker", String(kept.marker_mm))];
  const go = make("button", "", "Calibrate");
  go.type = "submit";
  const problem = make("p", "lens-problem", "");
  problem.setAttribute("role", "alert");
  const [sizeField, squareField, markerField] = [field("", size), field("", square, "mm"), field("", marker, "mm")];
  const modelField = field("Lens", model);
  modelField.dataset.hint = "Automatic takes the simplest model that predicts left-out views as well as any. plumb_bob: k1 k2 p1 p2 k3; rational: k1 to k6; fisheye: equidistant.";
  const dictionaryField = field("Dictionary", dictionary);
  const element = make("form", "lens-form", [
    make("h2", "", "Calibrate from the board in this recording"),
    field("Board", kind), sizeField, squareField, markerField, dictionaryField, modelField,
    make("div", "acts", [go]), problem,
  ]);
  element.noValidate = true;
  const name = (/** @type {HTMLElement} */ box, /** @type {[string, string]} */ [label, hint]) => {
    /** @type {HTMLElement} */ (box.firstElementChild).textContent = label;
    box.dataset.hint = hint;
  };
  const adapt = () => {
    const { size: ofSize, square: ofSquare, marker: ofMarker } = KINDS[kind.value];
    name(sizeField, ofSize);
    name(squareField, ofSquare);
    if (ofMarker) name(markerField, ofMarker);
    markerField.hidden = !ofMarker;
    dictionaryField.hidden = kind.value !== "charuco";
  };
  kind.onchange = adapt;
  adapt();
  element.onsubmit = (event) => {
    event.preventDefault();
    start();
  };
  return {
    element,
    /** Put the focus on the button that starts. */
    focus: () => go.focus(),
    /** What the form says; null, and the problem is shown, if a field is empty. @returns {Described|null} */
    read() {
      const said = { kind: /** @type {Described["kind"]} */ (kind.value), size: size.value.trim(), square_mm: number(square), marker_mm: kind.value === "checkerboard" ? 0 : number(marker), dictionary: kind.value === "charuco" ? dictionary.value : "", model: model.value };
      const bad = !said.size || !Number.isFinite(said.square_mm) || !Number.isFinite(said.marker_mm);
      problem.textContent = bad ? "Fill in the size of the board and its measures in millimeters." : "";
      if (bad) return null;
      try {
        localStorage.setItem(KEPT, JSON.stringify(said));
      } catch {
        // Without storage, the board is just not remembered.
      }
      return said;
    },
    /** @param {string} words why the server refused it */
    say(words) {
      problem.textContent = words;
    },
    /** @param {import("../messages.js").LensState} lens @param {boolean} running */
    tell(lens, running) {
      go.textContent = lens.can_resume ? "Resume" : lens.result ? "Calibrate again" : "Calibrate";
      go.disabled = running || !lens.images;
      go.dataset.hint = lens.images ? `Looks for the board in the ${lens.images} images of this recording. You can go on clicking meanwhile.` : "There are no images in this recording.";
    },
  };
}

/** @param {HTMLInputElement} input */
const number = (input) => (input.value.trim() === "" ? NaN : Number(input.value.replace(",", ".")));

/** @param {string} label @param {HTMLElement} control @param {string} [unit] */
const field = (label, control, unit = "") => make("label", "", [make("span", "name", label), control, unit ? make("span", "unit", unit) : ""]);

/** @param {string} name @param {string} value */
function entry(name, value) {
  const made = make("input", "", []);
  made.setAttribute("aria-label", name);
  made.value = value;
  made.autocomplete = "off";
  made.spellcheck = false;
  return made;
}

/** @param {string} name @param {[string, string][]} options @param {string} chosen */
function choice(name, options, chosen) {
  const made = make("select", "", options.map(([value, label]) => Object.assign(make("option", "", label), { value })));
  made.setAttribute("aria-label", name);
  if (options.some(([value]) => value === chosen)) made.value = chosen;
  return made;
}

/** What was said last. @returns {Described} */
function remembered() {
  /** @type {Described} */
  const usual = { kind: "checkerboard", size: "9x6", square_mm: 25, marker_mm: 18, dictionary: "DICT_5X5_100", model: "auto" };
  try {
    return { ...usual, ...JSON.parse(localStorage.getItem(KEPT) ?? "{}") };
  } catch {
    return usual;
  }
}
