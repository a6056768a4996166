// @ts-check
/** The 3D view: viser's own page in an iframe. It has its own connection to the server; the name of this tab links the two. */

import { listen } from "./keys.js";
import { make } from "./notices.js";
import { tab, tell } from "./socket.js";
import { on, state } from "./state.js";

const frame = /** @type {HTMLIFrameElement} */ (document.getElementById("space-view"));
const group = /** @type {HTMLElement} */ (document.getElementById("viewpoints"));
/** @type {[string, string, string][]} */
const VIEWPOINTS = [
  ["behind", "Behind", "Look forward from behind the radar."],
  ["above", "Above", "Look down on the radar; forward is up."],
  ["side", "Side", "Look from the right-hand side."],
  ["camera", "Camera", "Look from the camera's position."],
];

/** How long the 3D view waits after input on the page, so that mark and overlay are painted first [ms]. */
const HOLD = 250;

/** When the 3D view is loaded at the latest, counted from the recording's description: its first frame may be unreadable [ms]. */
const LATEST = 3000;

/** What static/pace.js reads in the 3D view's frame. */
const pace = { playing: false, holdUntil: 0 };

export function startSpace() {
  Object.assign(window, { cocalibPace: pace });
  on(["playing"], () => (pace.playing = state.playing));
  for (const type of ["pointerdown", "pointerup", "keydown", "wheel"])
    addEventListener(type, () => (pace.holdUntil = performance.now() + HOLD), { capture: true, passive: true });
  for (const [viewpoint, label, hint] of VIEWPOINTS) {
    const chip = make("button", "chip", label);
    chip.dataset.hint = hint;
    chip.dataset.viewpoint = viewpoint;
    chip.onclick = () => tell({ type: "viewpoint", viewpoint });
    group.append(chip);
  }
  frame.addEventListener("load", () => {
    if (frame.contentWindow) listen(frame.contentWindow);
    tint();
  });
  on(["theme"], tint);
  on(["shown", "look"], () => requestAnimationFrame(() => setTimeout(load)));
  on(["recording"], () => setTimeout(load, LATEST));
}

/** Load viser's page, once: it is large, and the first picture comes before it. */
function load() {
  if (!frame.hasAttribute("src")) frame.src = `viser/${tab}/`;
}

/** Apply the theme to the 3D view. */
function tint() {
  const root = frame.contentDocument?.documentElement;
  if (root) root.dataset.theme = document.documentElement.dataset.theme ?? "dark";
}
