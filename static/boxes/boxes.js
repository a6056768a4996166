/** Boxes around objects: which ones the frame on screen has, which one is selected, and how they are drawn. */

import { toDevice, viewport } from "../picture/geometry.js";
import { ink, smallFont, smallPx } from "../shell/colours.js";
import { emit, state } from "../shell/state.js";

/** @typedef {import("../messages.js").BoxTrackRow} Track */
/** Left, top, right, bottom [image px]. @typedef {[number, number, number, number]} Edges */
/** A box of the frame on screen. @typedef {{id: string, label: string, edges: Edges, kind: "stated"|"followed"|"between"|"draft", confidence: number}} Shown */
/** A box as the user left it, until the server has it; the id is "" for a new one. @typedef {{id: string, frame: number, edges: Edges, label: string, sent: boolean}} Draft */

/** Colours of objects, told apart also by the letters of their labels; Okabe and Ito's, for any eyes. */
const COLOURS = ["#56b4e9", "#e69f00", "#41c99a", "#f0e442", "#d78fbf", "#ff8a5c", "#9db4ff"];
/** Half the side of a handle [CSS px]. */
const HANDLE = 4;

export const boxing = {
  /** Whether boxes are drawn instead of clicks placed: while Evaluate is open. */ on: false,
  /** The selected object. @type {string|null} */ selected: null,
  /** The class of the next new box. */ label: "person",
  /** @type {import("../messages.js").FrameBoxes|null} */ frame: null,
  /** @type {Draft|null} */ draft: null,
};

/** Take the boxes of a frame; a draft that the server has is replaced by them. @param {import("../messages.js").FrameBoxes} message */
export function takeFrameBoxes(message) {
  boxing.frame = message;
  if (boxing.draft?.sent) boxing.draft = null;
  emit("boxes");
}

/** The boxes of the frame on screen, with the one that is being drawn or moved. @returns {Shown[]} */
export function shownBoxes() {
  const index = state.shown?.index ?? -1;
  const draft = boxing.draft?.frame === index ? boxing.draft : null;
  const known = boxing.frame?.index === index ? boxing.frame.boxes : [];
  const rows = known.filter(([id]) => id !== draft?.id).map(([id, label, edges, kind, confidence]) => /** @type {Shown} */ ({ id, label, edges, kind, confidence }));
  if (draft) rows.push({ id: draft.id, label: draft.label, edges: draft.edges, kind: "draft", confidence: 1 });
  return rows;
}

/** The selected object's row. @returns {Track|undefined} */
export const selectedTrack = () => state.view?.boxes.find((track) => track.id === boxing.selected);

/** The selected object's box in the frame on screen. @returns {Shown|undefined} */
export const selectedBox = () => (boxing.selected === null ? undefined : shownBoxes().find((box) => box.id === boxing.selected));

/** @param {string|null} id */
export function selectBox(id) {
  if (boxing.selected === id) return;
  boxing.selected = id;
  emit("boxes");
}

/** The colour of an object: the same in every frame. @param {string} id */
export function colourOf(id) {
  const place = state.view?.boxes.findIndex((track) => track.id === id) ?? -1;
  return COLOURS[Math.max(0, place) % COLOURS.length];
}

/** Corners and middles of the edges, by which a box is resized: which edges each one moves. @type {[("left"|"right")|null, ("top"|"bottom")|null][]} */
export const HANDLES = [
  ["left", "top"], [null, "top"], ["right", "top"], ["right", null],
  ["right", "bottom"], [null, "bottom"], ["left", "bottom"], ["left", null],
];

/** Where a handle of a box is [image px]. @param {Edges} edges @param {(typeof HANDLES)[number]} handle @returns {[number, number]} */
export function handleAt([left, top, right, bottom], [across, along]) {
  return [across === "left" ? left : across === "right" ? right : (left + right) / 2, along === "top" ? top : along === "bottom" ? bottom : (top + bottom) / 2];
}

/** Draw the returns of moving targets: filled triangles are in their box, hollow ones are not, crosses belong to no box. @param {CanvasRenderingContext2D} pen */
export function drawBoxedReturns(pen) {
  const returns = boxing.frame?.index === state.shown?.index ? (boxing.frame?.returns ?? []) : [];
  const size = 5 * viewport.unit;
  for (const [u, v, box, isInside] of returns) {
    const [x, y] = toDevice(u, v);
    const colour = box ? colourOf(box) : ink.grey;
    pen.beginPath();
    if (box) {
      pen.moveTo(x, y - size);
      pen.lineTo(x + size * 0.9, y + size * 0.7);
      pen.lineTo(x - size * 0.9, y + size * 0.7);
      pen.closePath();
    } else for (const side of [-1, 1]) {
      pen.moveTo(x - 0.7 * size, y - side * 0.7 * size);
      pen.lineTo(x + 0.7 * size, y + side * 0.7 * size);
    }
    pen.lineWidth = 4 * viewport.unit;
    pen.strokeStyle = ink.edge;
    pen.stroke();
    if (isInside) {
      pen.fillStyle = colour;
      pen.fill();
    }
    pen.lineWidth = 1.6 * viewport.unit;
    pen.strokeStyle = isInside ? "#ffffff" : colour;
    pen.stroke();
  }
  return returns.length > 0;
}

/** Draw the boxes of the frame on screen: stated solid, followed solid and thin, in between dashed. @param {CanvasRenderingContext2D} pen */
export function drawBoxes(pen) {
  const rows = shownBoxes();
  if (!boxing.on && !state.layers.boxes) return;
  for (const box of rows) if (box.id !== boxing.selected) drawBox(pen, box, false);
  for (const box of rows) if (box.id === boxing.selected) drawBox(pen, box, boxing.on && !state.playing);
}

/** @param {CanvasRenderingContext2D} pen @param {Shown} box @param {boolean} held */
function drawBox(pen, box, held) {
  const { ratio } = viewport;
  const [[left, top], [right, bottom]] = [toDevice(box.edges[0], box.edges[1]), toDevice(box.edges[2], box.edges[3])];
  const colour = colourOf(box.id);
  const width = (held ? 2 : box.kind === "followed" ? 1.2 : 1.8) * ratio;
  pen.setLineDash(box.kind === "between" ? [5 * ratio, 4 * ratio] : []);
  for (const [style, wide] of /** @type {[string, number][]} */ ([[ink.edge, width + 2 * ratio], [colour, width]])) {
    pen.lineWidth = wide;
    pen.strokeStyle = style;
    pen.strokeRect(left, top, right - left, bottom - top);
  }
  pen.setLineDash([]);
  drawName(pen, box, left, top, colour);
  if (!held) return;
  for (const handle of HANDLES) {
    const [x, y] = toDevice(...handleAt(box.edges, handle));
    pen.fillStyle = "#ffffff";
    pen.strokeStyle = ink.edge;
    pen.lineWidth = ratio;
    pen.fillRect(x - HANDLE * ratio, y - HANDLE * ratio, 2 * HANDLE * ratio, 2 * HANDLE * ratio);
    pen.strokeRect(x - HANDLE * ratio, y - HANDLE * ratio, 2 * HANDLE * ratio, 2 * HANDLE * ratio);
  }
}

/** The name of a box above it, or inside where there is no room. @param {CanvasRenderingContext2D} pen @param {Shown} box @param {number} left @param {number} top @param {string} colour */
function drawName(pen, box, left, top, colour) {
  const { ratio } = viewport;
  pen.font = smallFont(ratio);
  pen.textAlign = "left";
  pen.textBaseline = "alphabetic";
  const words = [box.id, box.label].filter(Boolean).join(" ");
  const high = (smallPx() + 4) * ratio;
  const y = top - high < 0 ? top + high : top;
  const wide = pen.measureText(words).width + 8 * ratio;
  pen.fillStyle = "rgb(0 0 0 / 62%)";
  pen.fillRect(left, y - high, wide, high);
  pen.fillStyle = colour;
  pen.fillRect(left, y - high, 2.5 * ratio, high);
  pen.fillStyle = "#ffffff";
  pen.fillText(words, left + 5 * ratio, y - 4 * ratio);
}
