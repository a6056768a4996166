// @ts-check
/** Parts of the export panel: the text with its comments set apart, the pose in numbers, the warnings. */

import { icon, make } from "./notices.js";

/** The text with its comments set apart. @param {string} content */
export function lines(content) {
  let inside = false;
  return content.split(/(?<=\n)/).map((line) => {
    const opens = line.includes("<!--");
    const said = inside || opens || /^\s*(#|%)/.test(line);
    inside = (inside || opens) && !line.includes("-->");
    return said ? make("i", "", line) : line;
  });
}

/** The pose in numbers, the order of the quaternion in its name. @param {Record<string, any>} preview */
export function numbers(preview) {
  const [x, y, z] = preview.translation_m.map((/** @type {number} */ value) => value.toFixed(4));
  const row = (/** @type {string} */ name, /** @type {string[]} */ values) =>
    make("tr", "", [make("th", "", name), ...values.map((value) => make("td", "", value))]);
  const table = make("table", "pose-numbers", [
    make("caption", "", "camera_from_radar"),
    row("translation_m", [x, y, z, ""]),
    row("quaternion_xyzw", preview.quaternion_xyzw.map((/** @type {number} */ value) => value.toFixed(4))),
  ]);
  table.dataset.hint = "Rounded here; the file has every digit.";
  return table;
}

/** What the solve warns of. @param {import("./messages.js").WarningRow[]} rows */
export function warningBox(rows) {
  if (!rows.length) return [];
  const title = rows.length === 1 ? "One warning comes with this calibration" : `${rows.length} warnings come with this calibration`;
  const items = rows.map((row) => {
    const item = make("li", "", row.message);
    item.dataset.hint = row.hint;
    return item;
  });
  return [make("div", "with-warnings", [make("strong", "", [icon("warning"), title]), make("ul", "", items)])];
}

const RECTIFIED = "cocalib-rectified";

/** The word about the pictures that a format without a place for distortion asks for. It is kept for this visit only: the next
 * recording's pictures may be others. @param {() => void} changed */
export function rectifiedBox(changed) {
  const box = make("input", "", []);
  box.type = "checkbox";
  try {
    box.checked = sessionStorage.getItem(RECTIFIED) === "1";
  } catch {
    // A browser that keeps nothing forgets the word, no more.
  }
  box.addEventListener("change", () => {
    try {
      sessionStorage.setItem(RECTIFIED, box.checked ? "1" : "0");
    } catch {
      // As above.
    }
    changed();
  });
  const label = make("label", "", [box, "My pictures are rectified (undistorted with this K)"]);
  label.dataset.hint = "They are undistorted with this same camera matrix, and no distortion is left in them: this format has no place for any.";
  return { box, row: make("div", "rectified", [label]) };
}
