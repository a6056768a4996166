/** The help dialog: keys, mouse and marks. */

import { ACTIONS, keyNames, register } from "../base/actions.js";
import { ink } from "../base/colours.js";
import { make, shape } from "../base/notices.js";

const dialog = /** @type {HTMLDialogElement} */ (document.getElementById("help-dialog"));
const ARROWS = ["←", "→", "↑", "↓"];
/** @type {[string, string][]} */
const MOUSE = [
  ["wheel", "Zoom at the cursor"],
  ["drag", "Pan the image"],
  ["click", "Place the mark for this frame"],
  ["drag a mark", "Move it"],
  ["drag", "In the rectified image: a line along a straight edge; Shift+drag pans"],
  ["Alt wheel", "Loupe: magnify more or less"],
  ["wheel", "On the timeline: zoom; with Shift: pan"],
  ["double click", "On the timeline: show all of it"],
];
/** @type {[string, string][]} */
const MARKS = [
  ["M8 1v5M8 10v5M1 8h5M10 8h5", "cross: your click; small and colored: a click in another frame"],
  ["M6.5 1h3v5.5H15v3H9.5V15h-3V9.5H1v-3h5.5z", "hollow cross: excluded click"],
  ["M8 3a5 5 0 1 0 .01 0z", "ring: reprojection of its radar position"],
  ["M2 13 13 3", "line between them: residual"],
  ["M1 8a7 4 0 1 0 14 0a7 4 0 1 0-14 0z||ring", "ellipse: contains 95 % of the clicks of good pairs"],
  ["M8 3a5 5 0 1 0 .01 0z|2.5 2.5", "dashed circle: expected position of the reflector"],
  ["M1 8 8 4.5 15 8 8 11.5z|2.5 2.5", "dashed diamond (ring in 3D): best next placement"],
  ["M8 1v4M8 11v4M1 8h4M11 8h4|2 1.5", "dashed cross: proposal, with a ring that contains 95 % of its error; numbers: other spots"],
  ["M8 5.5a2.5 2.5 0 1 0 .01 0z|fill|still", "dot: static radar return"],
  ["M8 4.5 12 11.5H4z|fill|moving", "triangle: moving radar return"],
];

/** Make it known. */
export function startHelp() {
  register({ id: "help", group: "Help", words: "Help", keys: ["?"], also: "keys mouse marks shortcuts legend manual", run: toggleHelp });
}

function toggleHelp() {
  if (dialog.open) return dialog.close();
  if (!dialog.childElementCount) build();
  dialog.showModal();
}

function build() {
  const close = make("button", "icon close", "×");
  close.setAttribute("aria-label", "Close");
  close.onclick = () => dialog.close();
  const groups = [...new Set(lines().map((line) => line.group))].map((group) => part(group, lines().filter((line) => line.group === group).map(({ keys, does }) => [keys, does])));
  const legend = make("div", "legend", MARKS.map(([path, words]) => make("div", "", [drawing(path), words])));
  const title = make("h2", "", "Keys, mouse and marks");
  title.id = "help-title";
  title.tabIndex = -1;
  title.autofocus = true;
  const docs = make("a", "", "documentation");
  docs.href = "/docs/";
  docs.target = "_blank";
  dialog.replaceChildren(
    title,
    make("p", "note", ["For everything else there is the ", docs, "."]),
    close,
    make("div", "groups", [...groups, part("Mouse", MOUSE.map(([hand, does]) => [[hand], does]))]),
    make("h3", "", "Marks in the image"),
    legend,
    note(),
  );
  dialog.addEventListener("click", (event) => {
    if (event.target === dialog) dialog.close();
  });
}

/** The actions that have keys, neighbours that share a line together. @returns {{group: string, does: string, keys: string[]}[]} */
function lines() {
  /** @type {{group: string, does: string, keys: string[]}[]} */
  const made = [];
  for (const { group, words, help = words, keys } of ACTIONS) {
    if (!keys) continue;
    const names = keyNames(keys[0]);
    const last = made.at(-1);
    if (last?.group === group && last.does === help) last.keys.push(...names.filter((name) => !last.keys.includes(name)));
    else made.push({ group, does: help, keys: names });
  }
  return made.map((line) => ({ ...line, keys: gathered(line.keys) }));
}

/** All four arrows in one word. @param {string[]} keys */
function gathered(keys) {
  const others = keys.filter((key) => !ARROWS.includes(key));
  return keys.length - others.length === ARROWS.length ? [...others, "arrows"] : keys;
}

/** @param {string} name @param {[string[], string][]} rows the keys, and what they do */
function part(name, rows) {
  const list = make("dl", "", rows.flatMap(([keys, does]) => [make("dt", "", keys.map(key)), make("dd", "", does)]));
  return make("section", "", [make("h3", "", name), list]);
}

function note() {
  return make("p", "note", ["Every click is saved to disk immediately; there is no save button. Colors run from blue (small residual) to red (large). Point at a figure or a control, or go to it with ", key("Tab"), ", for an explanation."]);
}

/** @param {string} name */
const key = (name) => make("span", "key", name);

/** @param {string} spec path|dashes or "fill"|colour of the mark */
function drawing(spec) {
  const [path, style, colour] = spec.split("|");
  const stroke = ink[/** @type {keyof typeof ink} */ (colour)] ?? "currentColor";
  const attributes = { d: path, fill: style === "fill" ? stroke : "none", stroke, "stroke-width": 1.5, "stroke-dasharray": style && style !== "fill" ? style : "none" };
  return shape("svg", { viewBox: "0 0 16 16", "aria-hidden": "true" }, [shape("path", attributes)]);
}
