/** Parts of the export panel: the text with its comments dimmed, the file's numbers, its check point, what it rests on. */

import { shape } from "./frames.js";
import { icon, make } from "./notices.js";

/** FileNumbers of app/cocalib/web/exports/file_numbers.py. @typedef {{title: string, rows: {name: string, values: string[], unit: string}[]}} Numbers */
/** CheckPointRow of app/cocalib/web/exports/check_point.py. @typedef {{words: string, u_px: number, v_px: number, width_px: number, height_px: number, pair: string}} CheckPoint */
/** How much of the picture's width the inset shows, and its shape. */
const INSET = 0.36;
const INSET_ASPECT = 0.34;

/** The text with its comments dimmed. @param {string} content */
export function lines(content) {
  let inside = false;
  return content.split(/(?<=\n)/).map((line) => {
    const opens = line.includes("<!--");
    const isComment = inside || opens || /^\s*(#|%)/.test(line);
    inside = (inside || opens) && !line.includes("-->");
    return isComment ? make("i", "", line) : line;
  });
}

/** The file's own numbers; folded below what follows from them, and the calibration's. @param {Record<string, any>} preview */
export function numbers({ pose, our_pose }) {
  const isChained = pose.in_third_frame.length > 0;
  const own = (isChained ? pose.in_third_frame : [pose.numbers]).map(table);
  for (const one of own) one.dataset.hint = "Read back from the file: its own numbers in its own order and units. Matrices are rounded to 9 decimals here; the file has all digits.";
  const below = isChained ? [pose.numbers, our_pose] : [our_pose];
  return [...own, ...below.map((one) => make("details", "ours", [make("summary", "", one.title), table(one)]))];
}

/** @param {Numbers} given */
function table({ title, rows }) {
  const most = Math.max(...rows.map((row) => row.values.length));
  const lines = rows.map(({ name, values, unit }) => {
    const cells = values.map((value) => make("td", "", value));
    if (cells.length === 1) cells[0].colSpan = most;
    return make("tr", "", [make("th", "", unit ? `${name} [${unit}]` : name), ...cells]);
  });
  return make("table", "pose-numbers", [make("caption", "", title), ...lines]);
}

/** The check point: in a cut-out of the picture, and in one sentence. @param {CheckPoint|null} point */
export function checkPoint(point) {
  if (!point) return [];
  const figure = make("figure", "check-point", [make("figcaption", "", [make("b", "", "Check point. "), point.words])]);
  if (point.pair) figure.append(inset(point, () => figure.querySelector("svg")?.remove()));
  return [figure];
}

/** A cut-out of the picture around the check point, with a mark on it. @param {CheckPoint} point @param {() => void} failed */
function inset({ u_px, v_px, width_px, height_px, pair }, failed) {
  const width = Math.max(INSET * width_px, 160);
  const height = width * INSET_ASPECT;
  const [u, v] = [u_px + 0.5, v_px + 0.5]; // pixel (0, 0) is the centre of the first one
  const left = Math.max(0, Math.min(width_px - width, u - width / 2));
  const top = Math.max(0, Math.min(height_px - height, v - height / 2));
  const svg = shape("svg", { viewBox: `${left} ${top} ${width} ${height}`, class: "inset", role: "img", "aria-label": "The check point in the picture" });
  const image = shape("image", { href: `api/check_point_picture?${encodeURIComponent(pair)}`, width: width_px, height: height_px });
  image.addEventListener("error", failed);
  const radius = 0.035 * width;
  const arm = (/** @type {number} */ from, /** @type {number} */ to) => `M${u + from} ${v}H${u + to}M${u} ${v + from}V${v + to}`;
  const path = `${arm(-1.7 * radius, -0.35 * radius)}${arm(0.35 * radius, 1.7 * radius)}`;
  svg.append(image);
  for (const name of ["rim", "mark"]) {
    const mark = shape("g", { class: name });
    mark.append(shape("circle", { cx: u, cy: v, r: radius }), shape("path", { d: path }));
    svg.append(mark);
  }
  return svg;
}

/** What is to be known before saving: what the pose rests on, what the file cannot hold, the warnings. @param {Record<string, any>} preview */
export function beforeSaving(preview) {
  const missing = preview.missing ? [make("div", "missing", [icon("warning"), make("strong", "", preview.missing)])] : [];
  return [make("div", "evidence", preview.evidence), ...missing, ...warningBox(preview.warnings)];
}

/** The warnings of the calibration. @param {import("./messages.js").WarningRow[]} rows */
function warningBox(rows) {
  if (!rows.length) return [];
  const title = rows.length === 1 ? "This calibration has one warning" : `This calibration has ${rows.length} warnings`;
  const items = rows.map((row) => {
    const item = make("li", "", row.message);
    item.dataset.hint = row.hint;
    return item;
  });
  const box = make("details", "with-warnings", [make("summary", "", [icon("warning"), title]), make("ul", "", items)]);
  box.open = true;
  return [box];
}
