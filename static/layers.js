// @ts-check
/** The overlays of the frame, each with a chip and a key. */

import { make } from "./notices.js";
import { emit, on, state } from "./state.js";

/** @typedef {keyof typeof state.layers} Layer */
/** @type {[Layer, string, string][]} */
const LAYERS = [
  ["returns", "Returns", "Radar returns of the nearest scan, carried into the picture: dots stand still, triangles move. (1)"],
  ["others", "All clicks", "The clicks of all other frames, coloured by residual. (2)"],
  ["ellipses", "95 %", "Where 95 % of the clicks of good pairs lie around their reprojection. (3)"],
  ["predictions", "Predicted", "Where radar and calibration expect the reflector of this placement (circle), and where the next placement pays most (diamond). (4)"],
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
  for (const chip of group.querySelectorAll("button")) {
    chip.setAttribute("aria-pressed", String(state.layers[/** @type {Layer} */ (chip.dataset.layer)]));
  }
}
