// @ts-check
/** The help dialog: keys, mouse and marks. */

import { ink } from "./colours.js";
import { KEYS } from "./keys.js";
import { make } from "./notices.js";

const dialog = /** @type {HTMLDialogElement} */ (document.getElementById("help-dialog"));
/** @type {[string, string][]} */
const MOUSE = [
  ["wheel", "zoom at the cursor"],
  ["drag", "pan the picture"],
  ["click", "place the mark for this frame"],
  ["drag a mark", "move it"],
];
/** @type {[string, string][]} */
const MARKS = [
  ["M8 1v5M8 10v5M1 8h5M10 8h5", "cross: your click; small and coloured: a click in another frame"],
  ["M6.5 1h3v5.5H15v3H9.5V15h-3V9.5H1v-3h5.5z", "hollow cross: excluded click"],
  ["M8 3a5 5 0 1 0 .01 0z", "ring: reprojection of its radar position"],
  ["M2 13 13 3", "line between them: residual"],
  ["M1 8a7 4 0 1 0 14 0a7 4 0 1 0-14 0z||ring", "ellipse: contains 95 % of the clicks of good pairs"],
  ["M8 3a5 5 0 1 0 .01 0z|2.5 2.5|guess", "dashed circle: expected position of the reflector"],
  ["M1 8 8 4.5 15 8 8 11.5z|2.5 2.5|guess", "dashed diamond (ring in 3D): best next placement"],
  ["M8 5.5a2.5 2.5 0 1 0 .01 0z|fill|still", "dot: static radar return"],
  ["M8 4.5 12 11.5H4z|fill|moving", "triangle: moving radar return"],
];

export function toggleHelp() {
  if (dialog.open) return dialog.close();
  if (!dialog.childElementCount) build();
  dialog.showModal();
}

function build() {
  const close = make("button", "icon close", "×");
  close.setAttribute("aria-label", "Close");
  close.onclick = () => dialog.close();
  const keys = make("dl", "", KEYS.flatMap(({ keys: names, does }) => [make("dt", "", names.map(key)), make("dd", "", does)]));
  const mouse = make("dl", "", MOUSE.flatMap(([hand, does]) => [make("dt", "", [key(hand)]), make("dd", "", does)]));
  const legend = make("div", "legend", MARKS.map(([path, words]) => make("div", "", [drawing(path), words])));
  const title = make("h2", "", "Shortcuts, mouse and marks");
  title.tabIndex = -1;
  title.autofocus = true;
  dialog.replaceChildren(
    title,
    close,
    make("div", "columns", [keys, make("div", "", [mouse, note()])]),
    legend,
  );
  dialog.addEventListener("click", (event) => {
    if (event.target === dialog) dialog.close();
  });
}

function note() {
  const text = make("p", "", "Every click is saved to disk immediately; there is no save button. Colours run from blue (small residual) to red (large). Hover over any number for an explanation.");
  text.style.maxWidth = "260px";
  text.style.color = "var(--muted)";
  return text;
}

/** @param {string} name */
const key = (name) => make("span", "key", name);

/** @param {string} spec path|dashes or "fill"|colour of the mark */
function drawing(spec) {
  const [path, style, colour] = spec.split("|");
  const stroke = ink[/** @type {keyof typeof ink} */ (colour)] ?? "currentColor";
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 16 16");
  svg.setAttribute("aria-hidden", "true");
  const shape = document.createElementNS("http://www.w3.org/2000/svg", "path");
  shape.setAttribute("d", path);
  shape.setAttribute("fill", style === "fill" ? stroke : "none");
  shape.setAttribute("stroke", stroke);
  shape.setAttribute("stroke-width", "1.5");
  if (style && style !== "fill") shape.setAttribute("stroke-dasharray", style);
  svg.append(shape);
  return svg;
}
