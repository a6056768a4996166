// @ts-check
/** Parts of the export panel: the text with its comments dimmed, the pose in numbers, the warnings. */

import { icon, make } from "./notices.js";

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

/** The pose in numbers, the order of the quaternion in its name. @param {Record<string, any>} preview */
export function numbers(preview) {
  const [x, y, z] = preview.translation_m.map((/** @type {number} */ value) => value.toFixed(4));
  const row = (/** @type {string} */ name, /** @type {string[]} */ values) =>
    make("tr", "", [make("th", "", name), ...values.map((value) => make("td", "", value))]);
  const table = make("table", "pose-numbers", [
    make("caption", "", "camera_from_radar"),
    row("translation_m", [x, y, z, ""]),
    row(...quaternion(preview)),
  ]);
  table.dataset.hint = "Rounded here; the file has full precision.";
  return table;
}

/** The quaternion in the order of the file: x y z w where the file says so, else as in our own. @param {Record<string, any>} preview @returns {[string, string[]]} */
function quaternion(preview) {
  const xyzw = preview.quaternion_xyzw.map((/** @type {number} */ value) => value.toFixed(4));
  return /x,? y,? z,? w/.test(preview.numbers) ? ["quaternion_xyzw", xyzw] : ["quaternion_wxyz", [xyzw[3], ...xyzw.slice(0, 3)]];
}

/** The warnings of the calibration. @param {import("./messages.js").WarningRow[]} rows */
export function warningBox(rows) {
  if (!rows.length) return [];
  const title = rows.length === 1 ? "This calibration has one warning" : `This calibration has ${rows.length} warnings`;
  const items = rows.map((row) => {
    const item = make("li", "", row.message);
    item.dataset.hint = row.hint;
    return item;
  });
  return [make("div", "with-warnings", [make("strong", "", [icon("warning"), title]), make("ul", "", items)])];
}

const RECTIFIED = "cocalib-rectified";

/** The user's statement that the pictures are rectified already, asked by formats that cannot hold distortion. It is kept for this
 * browser session only: the pictures of the next recording may differ. @param {() => void} changed */
export function rectifiedBox(changed) {
  const box = make("input", "", []);
  box.type = "checkbox";
  try {
    box.checked = sessionStorage.getItem(RECTIFIED) === "1";
  } catch {
    // Without storage, the choice is just not remembered.
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
  label.dataset.hint = "The pictures were undistorted with this camera matrix and have no distortion left. This format cannot hold distortion coefficients.";
  return { box, row: make("div", "rectified", [label]) };
}
