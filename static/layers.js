/** The overlays of the frame, each with a chip and a key. */

import { make } from "./notices.js";
import { toggleRectified, withoutRectified } from "./rectified.js";
import { emit, on, state } from "./state.js";

/** @typedef {keyof typeof state.layers} Layer */
/** @type {[Layer, string, string][]} */
const LAYERS = [
  ["returns", "Returns", "Radar returns of the nearest scan, projected into the picture: dots are static, triangles are moving. (1)"],
  ["others", "All clicks", "Clicks in all other frames, coloured by residual. (2)"],
  ["ellipses", "95 %", "Ellipses around the reprojections that contain 95 % of the clicks of good pairs. (3)"],
  ["predictions", "Predicted", "Expected position of the reflector in this placement (circle) and best next placement (diamond). (4)"],
];
const group = /** @type {HTMLElement} */ (document.getElementById("layers"));

export function startLayers() {
  LAYERS.forEach(([layer, label, hint], index) => {
    const chip = make("button", "chip", [make("kbd", "", String(index + 1)), label]);
    chip.dataset.layer = layer;
    chip.dataset.hint = hint;
    chip.onclick = () => toggleLayer(layer);
    group.append(chip);
  });
  const rectify = make("button", "chip", [make("kbd", "", "U"), "Rectified"]);
  rectify.dataset.layer = "rectified";
  rectify.onclick = toggleRectified;
  group.append(rectify);
  on(["layers", "lens"], draw);
  draw();
}

/** @param {Layer} layer */
export function toggleLayer(layer) {
  state.layers[layer] = !state.layers[layer];
  emit("layers");
}

function draw() {
  for (const chip of /** @type {NodeListOf<HTMLElement>} */ (group.querySelectorAll("button[data-layer]"))) {
    const layer = chip.dataset.layer;
    chip.setAttribute("aria-pressed", String(layer === "rectified" ? state.rectified : state.layers[/** @type {Layer} */ (layer)]));
    if (layer !== "rectified") continue;
    const why = withoutRectified();
    chip.hidden = why !== "";
    chip.dataset.hint = "The picture without the lens's distortion, with a grid: straight edges must be straight. Drag a line along one to compare. (U)";
  }
}
