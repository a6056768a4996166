/** A small drawing of the radar's and the camera's axes, with a bold arrow for the direction of the file's transform. */

const NS = "http://www.w3.org/2000/svg";
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
 * @param {Record<string, any>} pose PoseInFile of app/cocalib/web/exports/file_numbers.py
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

/** @param {string} name @param {Record<string, string|number>} attributes */
export function shape(name, attributes) {
  const element = document.createElementNS(NS, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, String(value));
  return element;
}
