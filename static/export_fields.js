/** What the user fills in on the export panel: frame names, the radar's pose in a third frame, whether pictures are rectified. */

import { make } from "./notices.js";

/** @typedef {Record<string, any>} Preview ExportPreview of app/cocalib/web/channel/export_preview.py */
const TYPING_MS = 250;
const RECTIFIED = "cocalib-rectified";
const PARENT = ["x", "y", "z", "qx", "qy", "qz", "qw"];
export const IDENTITY = ["0", "0", "0", "0", "0", "0", "1"];
const NAMES = [
  ["radar_frame", "Radar frame"],
  ["camera_frame", "Camera frame (optical)"],
];

/** A row of fields with the place for what is wrong with them. @param {string} name @param {(HTMLElement|string)[]} content */
function row(name, content) {
  const error = make("span", "error", "");
  error.id = `export-${name}-error`;
  error.setAttribute("role", "alert");
  const element = make("div", name, [...content, error]);
  return {
    element,
    /** Say what is wrong; "" if nothing is. @param {string} words */
    refuse(words) {
      error.textContent = words;
      error.hidden = !words;
      for (const input of element.querySelectorAll("input")) {
        input.setAttribute("aria-invalid", String(words !== ""));
        if (words) input.setAttribute("aria-describedby", error.id);
        else input.removeAttribute("aria-describedby");
      }
    },
  };
}

/** Call once typing has paused. @param {() => void} changed */
function afterTyping(changed) {
  let timer = 0;
  return () => {
    clearTimeout(timer);
    timer = window.setTimeout(changed, TYPING_MS);
  };
}

/** The two frame names. @param {() => void} changed */
export function nameFields(changed) {
  const soon = afterTyping(changed);
  /** What the user typed instead of the calibration's names. @type {Map<string, string>} */
  const typed = new Map();
  const inputs = NAMES.map(([key, words]) => {
    const input = make("input", "", []);
    input.type = "text";
    input.spellcheck = false;
    input.autocomplete = "off";
    input.dataset.field = key;
    input.setAttribute("aria-label", words);
    input.addEventListener("input", () => {
      if (input.value === input.dataset.usual) typed.delete(key);
      else typed.set(key, input.value);
      soon();
    });
    return input;
  });
  const made = row("names", inputs.map((input, index) => make("label", "", [make("span", "", NAMES[index][1]), input])));
  return {
    ...made,
    typed,
    /** Show the calibration's names where the user typed none. @param {Preview} preview */
    draw(preview) {
      for (const input of inputs) {
        const key = String(input.dataset.field);
        input.dataset.usual = preview[key];
        if (!typed.has(key)) input.value = preview[key];
        input.disabled = !preview.names_frames;
      }
      made.element.dataset.hint = preview.names_frames ? "" : "This format holds no frame names.";
    },
  };
}

/** The radar's pose in a third frame. @param {string[]} values as kept @param {(values: string[]) => void} changed */
export function parentFields(values, changed) {
  const label = make("span", "", "Radar pose in the kit, rig or ego frame");
  label.dataset.hint = "parent_from_radar: position in metres, rotation as a quaternion in the order x y z w. By default the radar is the origin.";
  /** @type {HTMLInputElement[]} */
  const inputs = [];
  const soon = afterTyping(() => changed(inputs.map((input, index) => input.value.trim() || IDENTITY[index])));
  for (const [index, name] of PARENT.entries()) {
    const input = make("input", "", []);
    input.type = "text";
    input.inputMode = "decimal";
    input.value = values[index] ?? IDENTITY[index];
    input.setAttribute("aria-label", `${name} of the radar in the parent frame`);
    input.addEventListener("input", soon);
    inputs.push(input);
  }
  return row("parent", [label, make("div", "", inputs.map((input, index) => make("label", "", [index < 3 ? `${PARENT[index]} [m]` : PARENT[index], input])))]);
}

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
