/**
 * What the user fills in on the page Deliver: frame names, the radar's pose in a third frame, whether images are rectified; and the
 * drawing of the axes with the direction of the file's transform.
 */

import { make, shape } from "../base/notices.js";

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
  label.dataset.hint = "parent_from_radar: position in meters, rotation as a quaternion in the order x y z w. By default the radar is the origin.";
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

/** The user's statement that the images are rectified already, asked by formats that cannot hold distortion. It is kept for this
 * browser session only: the images of the next recording may differ. @param {() => void} changed */
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
  const label = make("label", "", [box, "My images are rectified (undistorted with this K)"]);
  label.dataset.hint = "The images were undistorted with this camera matrix and have no distortion left. This format cannot hold distortion coefficients.";
  return { box, row: make("div", "rectified", [label]) };
}

const RETURNS = { raw: "returns as the radar reports them", corrected: "corrected" };

/** Which radar data the pose is for; `chosen` is "" until the user says, and then what the format is used for decides. @param {() => void} changed */
export function returnsChoice(changed) {
  const choice = { chosen: "", row: make("fieldset", "rectified returns", []), draw };
  const gain = make("span", "gain", "");
  const buttons = Object.entries(RETURNS).map(([key, words]) => {
    const button = make("input", "", []);
    Object.assign(button, { type: "radio", name: "returns", value: key });
    button.addEventListener("change", () => {
      choice.chosen = key;
      changed();
    });
    choice.row.append(make("label", "", [button, words]));
    return button;
  });
  choice.row.prepend(make("legend", "", "Pose for"));
  choice.row.append(gain);
  /** @param {{is_for: "raw"|"corrected", gain: string}|null} other the pose that the file could hold instead */
  function draw(other) {
    if (!other) return;
    for (const button of buttons) button.checked = button.value !== other.is_for;
    gain.textContent = `${other.is_for === "raw" ? "as reported" : "corrected"}: ${other.gain}`;
  }
  return choice;
}

/** What is asked before a contradictory calibration is saved; asked again for each. @param {() => void} changed */
export function despiteBox(changed) {
  const box = make("input", "", []);
  box.type = "checkbox";
  box.addEventListener("change", changed);
  const label = make("label", "", [box, "Write it nevertheless: the data contradict this calibration"]);
  label.dataset.hint = "The file says so where it can; on the command line, --despite-verdict.";
  return { box, row: make("div", "rectified despite", [label]) };
}

const WIDTH = 280;
const HEIGHT = 168;
const RADAR = [72, 72];
const CAMERA = [206, 72];
const LENGTH = 42;
/** A longer frame name is cut in the middle. */
const LONGEST = 20;
/** Directions of the radar's x (forward), y (left) and z (up) in the drawing: seen from behind, from the left and from above. */
const PAPER = [
  [0.64, -0.4],
  [-0.82, -0.26],
  [0, -0.94],
];
const COLOURS = ["var(--axis-x)", "var(--axis-y)", "var(--axis-z)"];

/**
 * Draw both frames, with a bold arrow the way that the file's numbers carry points. The directions of the axes are the solved
 * ones; the positions are not to scale.
 * @param {Record<string, any>} pose PoseInFile of app/cocalib/web/exports.py
 */
export function frameDrawing(pose) {
  const svg = shape("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, class: "frames", role: "img" });
  svg.append(titled(pose.words));
  const [from, to] = pose.carries === "camera_from_radar" ? [RADAR, CAMERA] : [CAMERA, RADAR];
  svg.append(arrow(to, from, 34, 5, "inverse"), arrow(from, to, 16, 8, "carry"));
  svg.append(label(139, 79, "R, t", "equation"), label(139, 119, "inverse", "inverse"), label(WIDTH / 2, 159, pose.equation, "equation"));
  const unit = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
  axes(svg, RADAR, unit);
  axes(svg, CAMERA, pose.camera_axes);
  svg.append(label(RADAR[0], 139, short(pose.radar_frame), "frame"), label(CAMERA[0], 139, short(pose.camera_frame), "frame"));
  return svg;
}

/** @param {string} name */
const short = (name) => (name.length > LONGEST ? `${name.slice(0, LONGEST / 2 - 1)}…${name.slice(-LONGEST / 2)}` : name);

/** Three arrows with their letters; `directions` are the axes in the radar frame. @param {Element} svg @param {number[]} at @param {number[][]} directions */
function axes(svg, at, directions) {
  for (const [index, [x, y, z]] of directions.entries()) {
    const dx = LENGTH * (x * PAPER[0][0] + y * PAPER[1][0] + z * PAPER[2][0]);
    const dy = LENGTH * (x * PAPER[0][1] + y * PAPER[1][1] + z * PAPER[2][1]);
    const length = Math.hypot(dx, dy) || 1;
    const [ux, uy] = [dx / length, dy / length];
    const [ex, ey] = [at[0] + dx, at[1] + dy];
    const head = `M${ex} ${ey}L${ex - 7 * ux + 3 * uy} ${ey - 7 * uy - 3 * ux}L${ex - 7 * ux - 3 * uy} ${ey - 7 * uy + 3 * ux}Z`;
    svg.append(shape("path", { d: `M${at[0]} ${at[1]}L${ex - 5 * ux} ${ey - 5 * uy}`, stroke: COLOURS[index], "stroke-width": 2, fill: "none" }));
    svg.append(shape("path", { d: head, fill: COLOURS[index] }));
    const letter = label(ex + 8 * ux, ey + 8 * uy + 3.5, "xyz"[index], "axis");
    letter.setAttribute("fill", COLOURS[index]);
    svg.append(letter);
  }
  svg.append(shape("circle", { cx: at[0], cy: at[1], r: 3, class: "origin" }));
}

/** An arrow from one frame to the other. @param {number[]} from @param {number[]} to @param {number} lower how far below the origins @param {number} head its size @param {string} name */
function arrow(from, to, lower, head, name) {
  const sign = Math.sign(to[0] - from[0]);
  const [start, end, y] = [from[0] + sign * 14, to[0] - sign * 14, from[1] + lower];
  const group = shape("g", { class: name });
  group.append(
    shape("path", { d: `M${start} ${y}H${end}`, fill: "none" }),
    shape("path", { d: `M${end - sign * head} ${y - 0.7 * head}L${end} ${y}L${end - sign * head} ${y + 0.7 * head}`, fill: "none" }),
  );
  return group;
}

/** @param {number} x @param {number} y @param {string} words @param {string} name */
function label(x, y, words, name) {
  const element = shape("text", { x, y, class: name, "text-anchor": "middle" });
  element.textContent = words;
  return element;
}

/** @param {string} words */
function titled(words) {
  const title = shape("title", {});
  title.textContent = words;
  return title;
}
