/** The whole image with its marks, small in a corner: while it is zoomed in, with what is in sight; and while the 3D view has its place. */

import { act, actionNamed } from "../base/actions.js";
import { ink } from "../base/colours.js";
import { make } from "../base/notices.js";
import { clicks, emit, on, state } from "../base/state.js";
import { lookAt, toImage, viewport } from "./geometry.js";
import { redraw } from "./image.js";
import { outlined } from "./marks.js";

/** It is as large as this part of the image's box, within these limits [CSS px]. */
const [SHARE, LEAST, MOST] = [0.24, 96, 240];
/** It is not needed while more than this part of the image is in sight. */
const MUCH = 0.5;
const canvas = make("canvas", "", []);
const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
const isSwapped = () => document.body.classList.contains("space-large") && document.documentElement.dataset.shape === "wide";

export function startInset() {
  canvas.id = "inset";
  canvas.hidden = true;
  canvas.setAttribute("aria-hidden", "true");
  document.getElementById("image-pane")?.append(canvas);
  canvas.addEventListener("pointerdown", go);
  canvas.addEventListener("pointermove", (event) => event.buttons && go(event));
  canvas.addEventListener("click", () => isSwapped() && act(actionNamed("space-large")));
  on(["shown", "view", "box", "theme"], draw);
}

/** Bring what is under the pointer to the middle. @param {PointerEvent} event */
function go(event) {
  if (isSwapped()) return;
  lookAt((event.offsetX / canvas.clientWidth) * viewport.imageWidth - 0.5, (event.offsetY / canvas.clientHeight) * viewport.imageHeight - 0.5);
  redraw();
  emit("box");
}

function draw() {
  const shown = state.shown;
  const seen = (viewport.width * viewport.height * viewport.ratio ** 2) / (viewport.imageWidth * viewport.imageHeight * viewport.scale ** 2);
  canvas.hidden = !shown || (seen > MUCH && !isSwapped());
  if (!shown || canvas.hidden) return;
  const wide = Math.min(MOST, Math.max(LEAST, SHARE * viewport.width));
  const scale = (viewport.ratio * wide) / shown.width;
  [canvas.width, canvas.height] = [Math.round(shown.width * scale), Math.round(shown.height * scale)];
  canvas.style.width = `${canvas.width / viewport.ratio}px`;
  canvas.classList.toggle("aside", !isSwapped() && viewport.left >= 0); // at the image's left edge nothing can be moved from below it
  pen.drawImage(shown.bitmap, 0, 0, canvas.width, canvas.height);
  const toInset = (/** @type {number} */ u, /** @type {number} */ v) => /** @type {const} */ ([(u + 0.5) * scale, (v + 0.5) * scale]);
  for (const { u_px, v_px, frame } of clicks()) {
    outlined(pen, ink.click, 1.5, () => pen.arc(...toInset(u_px, v_px), (frame === shown.index ? 3 : 1.5) * viewport.unit, 0, 2 * Math.PI));
  }
  if (isSwapped()) return;
  const [[left, top], [right, bottom]] = [toInset(...toImage(0, 0)), toInset(...toImage(viewport.width, viewport.height))];
  outlined(pen, ink.ring, 1.5, () => pen.rect(left, top, right - left, bottom - top));
}
