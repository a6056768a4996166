// @ts-check
/** The overlays of the frame, each with a chip and a key. */

import { make } from "./notices.js";
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
  on(["layers"], draw);
  draw();
}

/** @param {Layer} layer */
export function toggleLayer(layer) {
  state.layers[layer] = !state.layers[layer];
  emit("layers");
}

function draw() {
  for (const chip of /** @type {NodeListOf<HTMLElement>} */ (group.querySelectorAll("button[data-layer]"))) {
    chip.setAttribute("aria-pressed", String(state.layers[/** @type {Layer} */ (chip.dataset.layer)]));
  }
}
