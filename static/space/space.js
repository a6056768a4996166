/** The 3D view: viser's own page in an iframe. It has its own connection to the server; the name of this tab links the two. */

import { opened, register, withImages } from "../base/actions.js";
import { icon, make } from "../base/notices.js";
import { tab, tell } from "../base/socket.js";
import { clicks, emit, on, select, state } from "../base/state.js";
import { comeTo } from "../image/arriving.js";
import { choose } from "../image/candidates.js";
import { addToCursor, tellCursor } from "../time/player.js";
import { candidates, frameShown, itemAt, layer, spaceFrame, mark, onDrawn, pickable, pickedWords, imageBox, redraw, startLayer, takeFrame } from "./layer.js";
import { changeSpace, cursorOptions, spaceColour, spaceOptions } from "./options.js";

/** @typedef {import("./options.js").Colour} Colour */
const pane = /** @type {HTMLElement} */ (document.getElementById("space"));
const frame = /** @type {HTMLIFrameElement} */ (document.getElementById("space-view"));
const group = /** @type {HTMLElement} */ (document.getElementById("viewpoints"));
/** @type {[string, string, string][]} */
const VIEWPOINTS = [
  ["behind", "Behind", "Look forward from behind the radar; the placements, or without any all returns, are in sight."],
  ["above", "Above", "Look down on the radar; forward is up."],
  ["side", "Side", "Look from the right-hand side."],
];
/** @type {[NonNullable<Colour>, string][]} */
const COLOURS = [["speed", "Still"], ["range", "Range"], ["doppler", "Doppler"], ["amplitude", "SNR"], ["height", "Height"]];
const TRAILS_S = [0, 2, 10];
/** A press that moves farther than this turns the view [CSS px]. */
const THRESHOLD = 4;
/** How long the 3D view waits after input on the page, so that mark and overlay are painted first [ms]. */
const HOLD = 250;

/** Time between two drawings while playing, with and without images [ms]. */
const [PLAYING_EVERY, LOOKING_EVERY] = [1000, 340];
/** When the 3D view is loaded at the latest, counted from the recording's description: its first frame may be unreadable [ms]. */
const LATEST = 3000;

/** After so long without a drawing, the returns are shown from above instead [ms]. */
const PATIENCE = 10_000;
const birdseye = /** @type {HTMLElement} */ (document.getElementById("birdseye"));
const whyFlat = make("p", "space-why", "");

/** What the Camera view says before it can place the returns. */
const NO_POSE = "No pose yet: the returns appear here once enough placements are clicked.";

const SPACE = { group: "3D view", when: opened };

/** What pace.js reads in the 3D view's frame. */
const pace = { playing: false, every: 1000, holdUntil: 0 };
const cameraChip = chip("Camera", "The page's own image with the radar returns in front of it, through the same lens.", () => setCamera(!spaceOptions.camera));
const largeChip = chip("", "Enlarge the 3D view (B)", toggleLarge);
largeChip.setAttribute("aria-label", "Enlarge the 3D view");
const hideChip = chip("Hide 3D", "Hide the 3D view; it then costs nothing (V)", toggleHidden);
const trailChip = chip("", "For how long returns stay; they fade with age. Click for longer.", nextTrail);
const colours = make("select", "chip", COLOURS.map(([value, label]) => { const option = make("option", "", label); option.value = value; return option; }));
const legend = make("span", "space-legend", []);
const readout = make("div", "space-readout", []);
const standing = make("span", "space-frame", []);
/** @type {{x: number, y: number}|null} */
let press = null;

/** @param {(owner: Window) => void} listen makes the keys work in a window */
export function startSpace(listen) {
  addToCursor(cursorOptions);
  register(
    { id: "view-behind", words: "3D: look from behind the radar", also: "viewpoint", run: () => lookFrom("behind"), ...SPACE },
    { id: "view-above", words: "3D: look down from above", also: "viewpoint top bird", run: () => lookFrom("above"), ...SPACE },
    { id: "view-side", words: "3D: look from the side", also: "viewpoint right", run: () => lookFrom("side"), ...SPACE },
    { id: "view-camera", words: "3D: look from the camera, over its image", also: "viewpoint overlay reprojection", run: () => setCamera(true), group: "3D view", when: withImages },
    { id: "space-hide", words: "Hide or show the 3D view", keys: ["V"], also: "3D close", run: toggleHidden, ...SPACE },
    { id: "space-large", words: "Enlarge the 3D view, or give the image its place back", keys: ["B"], also: "3D big maximize full", run: toggleLarge, ...SPACE },
  );
  Object.assign(window, { cocalibPace: pace, __cocalibSpace: { spaceFrame, pickable, imageBox, frameShown, itemAt } });
  on(["playing"], () => Object.assign(pace, { playing: state.playing, every: state.looking ? LOOKING_EVERY : PLAYING_EVERY }));
  for (const type of ["pointerdown", "pointerup", "keydown", "wheel"])
    addEventListener(type, () => (pace.holdUntil = performance.now() + HOLD), { capture: true, passive: true });
  startChips();
  startLayer(frame);
  frame.addEventListener("load", () => {
    if (frame.contentWindow && frame.contentDocument) {
      listen(frame.contentWindow);
      follow(frame.contentWindow);
    }
    tint();
  });
  follow(layer);
  on(["theme"], tint);
  on(["recording", "layers"], () => (arrange(), drawBar()));
  on(["cursor", "shown"], drawStanding);
  onDrawn(() => (flatten(""), drawBar(), drawStanding(), drawReadout(null)));
  arrange();
  on(["shown", "look"], () => requestAnimationFrame(() => setTimeout(load)));
  on(["recording"], () => setTimeout(load, LATEST));
}

/** Load viser's page, once: it is large, and the first image comes before it. */
function load() {
  if (frame.hasAttribute("src") || whyFlat.textContent) return;
  if (!document.createElement("canvas").getContext("webgl2")) return flatten("No 3D view: this browser has no WebGL2.");
  frame.src = `viser/${tab}/`;
  setTimeout(() => frameShown() === null && flatten(`No 3D view: nothing was drawn within ${PATIENCE / 1000} s.`), PATIENCE);
}

/** Show the returns from above in the place of the 3D view, or that again. @param {string} why "" once the 3D view has drawn */
function flatten(why) {
  if (why === whyFlat.textContent) return;
  whyFlat.textContent = why;
  pane.classList.toggle("flat", why !== "");
  if (!state.looking) (why ? pane : document.getElementById("image-pane"))?.append(birdseye);
}

/** Take what the server says about the 3D view. @param {import("../messages.js").SpaceFrame} look */
export const takeSpace = (look) => takeFrame(look);

function startChips() {
  for (const [viewpoint, label, hint] of VIEWPOINTS) {
    const made = chip(label, hint, () => lookFrom(viewpoint));
    made.dataset.viewpoint = viewpoint;
    group.append(made);
  }
  cameraChip.dataset.viewpoint = "camera";
  largeChip.append(icon("large"));
  for (const [made, id] of /** @type {[HTMLElement, string][]} */ ([[cameraChip, "space-camera"], [largeChip, "space-large"], [hideChip, "space-hide"], [trailChip, "space-trail"], [colours, "space-colour"]])) made.id = id;
  group.append(cameraChip, colours, trailChip);
  document.querySelector(".over-space")?.append(largeChip, hideChip);
  colours.setAttribute("aria-label", "What the colors of the returns mean");
  colours.dataset.hint = "What the colors of the returns mean";
  colours.onchange = () => change({ colour: /** @type {Colour} */ (colours.value) });
  readout.setAttribute("role", "status");
  pane.append(make("div", "space-bar", [legend, standing]), readout, whyFlat);
}

/** @param {string} label @param {string} hint @param {() => void} action */
function chip(label, hint, action) {
  const made = make("button", "chip", label);
  made.dataset.hint = hint;
  made.onclick = action;
  return made;
}

/** Change what is shown, and tell the server. @param {Partial<typeof spaceOptions>} changed */
function change(changed) {
  changeSpace(changed);
  arrange();
  tellCursor();
  redraw();
}

/** Hide the 3D view, or show it again. */
function toggleHidden() {
  change({ hidden: !spaceOptions.hidden, large: false });
}

/** Let the 3D view take the place of the image, or give it back. */
function toggleLarge() {
  change({ large: !spaceOptions.large, hidden: false });
}

/** Move the 3D view's camera. @param {string} viewpoint */
function lookFrom(viewpoint) {
  setCamera(false);
  tell({ type: "viewpoint", viewpoint });
}

/** Show the page's own image with the returns in front, or the 3D view. @param {boolean} camera */
function setCamera(camera) {
  if (spaceOptions.camera === camera) return;
  changeSpace({ camera });
  arrange();
  redraw();
}

function nextTrail() {
  change({ trail_s: TRAILS_S[(TRAILS_S.indexOf(spaceOptions.trail_s) + 1) % TRAILS_S.length] });
}

/** Apply the options to the page. */
function arrange() {
  const { hidden, large, camera, trail_s: trail } = spaceOptions;
  document.body.classList.toggle("space-hidden", hidden);
  document.body.classList.toggle("space-large", large);
  pane.classList.toggle("camera", camera);
  cameraChip.hidden = state.looking;
  trailChip.hidden = state.looking;
  cameraChip.setAttribute("aria-pressed", String(camera));
  largeChip.setAttribute("aria-pressed", String(large));
  hideChip.textContent = hidden ? "Show 3D" : "Hide";
  hideChip.dataset.hint = hidden ? "Show the 3D view (V)" : "Hide the 3D view; it then costs nothing (V)";
  trailChip.textContent = trail ? `Last ${trail} s` : "One scan";
  trailChip.setAttribute("aria-pressed", String(trail > 0));
  colours.value = spaceColour();
  emit("box");
}

/** What the colours mean. */
function drawBar() {
  const known = spaceFrame()?.legend;
  if (!known) return;
  const parts = known.ramp
    ? [known.low, make("i", "ramp", []), known.high]
    : known.colours.map((colour, index) => { const part = make("span", "", `● ${index ? known.high : known.low}`); part.style.color = colour; return part; });
  if (known.ramp) /** @type {HTMLElement} */ (parts[1]).style.background = `linear-gradient(90deg, ${known.colours.join(", ")})`;
  legend.replaceChildren(...parts);
}

/** At which frame the 3D view stands, so that one sees if it is behind. */
function drawStanding() {
  const index = frameShown();
  const behind = index !== null && index !== state.cursor;
  standing.textContent = index === null ? "" : `${state.looking ? "scan" : "frame"} ${index + 1}`;
  standing.classList.toggle("behind", behind);
}

/** Words about what is under the pointer, else about what was picked. @param {import("./layer.js").Item|null} item */
function drawReadout(item) {
  const unplaced = spaceOptions.camera && spaceFrame()?.projected === false;
  const words = item?.words ?? (hovered?.words || pickedWords() || (unplaced ? NO_POSE : ""));
  if (readout.textContent !== words) readout.textContent = words;
}

/** @type {import("./layer.js").Item|null} */
let hovered = null;

/** Follow the pointer in the frame of the 3D view, or over the Camera view. @param {Window|HTMLElement} owner */
function follow(owner) {
  const listenTo = (/** @type {string} */ type, /** @type {(event: PointerEvent) => void} */ listener) => owner.addEventListener(type, /** @type {EventListener} */ (listener), { capture: true, passive: true });
  listenTo("pointermove", (event) => { if (!event.buttons) hover(...at(event)); });
  listenTo("pointerdown", (event) => { const [x, y] = at(event); press = event.button === 0 ? { x, y } : null; });
  listenTo("pointerup", released);
  listenTo("pointerleave", () => hover(-1, -1));
  if (owner === frame.contentWindow) frame.contentDocument?.documentElement.addEventListener("pointerleave", () => hover(-1, -1));
}

/** Place of an event in the view: the frame and the layer fill it. @param {PointerEvent} event @returns {[number, number]} CSS px */
const at = (event) => (event.view === window ? [event.offsetX, event.offsetY] : [event.clientX, event.clientY]);

/** @param {number} x @param {number} y */
function hover(x, y) {
  hovered = itemAt(x, y);
  if (mark("hover", hovered)) drawReadout(hovered);
}

/** @param {PointerEvent} event */
function released(event) {
  const [[x, y], from] = [at(event), press];
  press = null;
  if (!from || Math.hypot(x - from.x, y - from.y) > THRESHOLD) return;
  const item = itemAt(x, y);
  mark("picked", item);
  if (item) pick(item);
}

/** Go where an item leads; a return is only marked. @param {import("./layer.js").Item} item */
function pick(item) {
  drawReadout(item);
  const look = spaceFrame();
  if (item.kind === "placement" && state.placements[item.index]) comeTo(state.placements[item.index].frame);
  const candidate = item.kind === "candidate" ? candidates()[item.index] : undefined;
  if (candidate && !candidate.chosen) choose(item.index);
  const id = item.kind === "reflector" ? look?.reflectors[item.index].id : undefined;
  const click = id === undefined ? undefined : clicks().find((one) => one.id === id);
  if (!click) return;
  comeTo(click.frame);
  select(click.id);
}

/** Apply the theme to the 3D view. */
function tint() {
  const root = frame.contentDocument?.documentElement;
  if (root) root.dataset.theme = document.documentElement.dataset.theme ?? "dark";
}
