/**
 * The sheet "Lens": the intrinsics in use, a form that calibrates them from a board in the recording, how far that is, and the result.
 */

import { register, withImages } from "../base/actions.js";
import { showPage } from "../base/layout.js";
import { make, toast } from "../base/notices.js";
import { send } from "../base/socket.js";
import { emit, on, state } from "../base/state.js";
import { toggleRectified, withoutRectified } from "../image/rectified.js";
import { boardForm } from "./board.js";
import { drawCoverage, drawLensResult, lensResult, parameters, saveCamera, takeLensResult } from "./result.js";

const page = /** @type {HTMLElement} */ (document.getElementById("page-lens"));
const present = make("section", "lens-present", []);
const form = boardForm(start);
let drawn = "";
/** Whether the sheet was opened by itself, since there are no intrinsics. */
let led = false;
let busy = false;
/** Whether a calibration ran since the sheet last showed a result. */
let awaited = false;

export function startLens() {
  register(
    { id: "lens", group: "Panel", words: "Lens: intrinsics, and calibrating them from a board", also: "sheet camera intrinsics checkerboard charuco aprilgrid calibrate focal length distortion", run: () => showPage("lens"), when: withImages },
    { id: "save-camera", group: "File", words: "Save the intrinsics in use as camera.yaml", also: "export download camera_info lens", run: () => saveCamera(true), when: () => withImages() || (state.lens?.intrinsics ? "" : "There are no intrinsics yet") },
  );
  present.setAttribute("aria-label", "Intrinsics in use");
  startLensProgress(cancelLens);
  page.append(present, lensProgress, lensResult, form.element);
  on(["lens", "recording", "layers"], draw);
  on(["box", "theme"], drawPlots);
}

/** @param {import("../messages.js").LensState} message */
export function takeLens(message) {
  state.lens = message;
  if (state.recording) state.recording.intrinsics = message.intrinsics?.about ?? "";
  if (!message.intrinsics && message.images && !led) showPage("lens");
  led = true;
  emit("lens");
}

/** @param {import("../messages.js").LensResult} message */
export function takeResult(message) {
  takeLensResult(message);
  emit("lens");
}

async function start() {
  const wanted = form.read();
  if (!wanted || busy) return;
  busy = true;
  const refusal = await send({ type: "lens_calibrate", ...wanted });
  busy = false;
  form.say(refusal ?? "");
}

/** Stop looking for the board. */
async function cancelLens() {
  const refusal = await send({ type: "lens_cancel" });
  if (refusal) toast(refusal);
}

/** Go back to the intrinsics that the recording was opened with. */
async function useGiven() {
  const refusal = await send({ type: "intrinsics_chosen", intrinsics: null });
  if (refusal) toast(refusal);
}

function draw() {
  const lens = state.lens;
  if (!lens) return;
  const [started, cancelled] = [form.element, lensProgress].map((element) => element.contains(document.activeElement));
  form.element.hidden = running();
  form.tell(lens, running());
  const text = JSON.stringify([lens, state.rectified]);
  if (text === drawn) return;
  drawn = text;
  drawPresent(lens);
  drawProgress(lens);
  if (started && running()) focusCancel();
  if (cancelled && !running()) form.focus();
  drawLensResult();
  drawPlots();
  showResult(lens);
}

/** Bring a result that has just come into sight. @param {import("../messages.js").LensState} lens */
function showResult(lens) {
  if (running()) awaited = true;
  else if (awaited && lens.stage === "done" && !lensResult.hidden) {
    awaited = false;
    lensResult.scrollIntoView({ block: "start" });
  }
}

/** @param {import("../messages.js").LensState} lens */
function drawPresent(lens) {
  const camera = lens.intrinsics;
  present.hidden = !camera && running();
  if (!camera) {
    const words = lens.images
      ? "The lens is not known yet. Calibrate it here from a board in this recording, or drop a camera file on the page. You can click now; the pose needs the lens."
      : "There are no images in this recording.";
    return present.replaceChildren(make("h2", "", "No intrinsics"), make("p", "lens-none", words));
  }
  const rectify = make("button", "second", state.rectified ? "Image as taken" : "Rectified image");
  rectify.dataset.hint = "Straight edges must be straight in it. (U)";
  rectify.setAttribute("aria-pressed", String(state.rectified));
  rectify.disabled = withoutRectified() !== "";
  rectify.onclick = toggleRectified;
  const save = make("button", "second", "Save camera.yaml");
  save.dataset.hint = "These intrinsics as a file: for ROS, or for --camera.";
  save.onclick = () => saveCamera(true);
  const back = make("button", "second", "Use the former ones");
  back.dataset.hint = "Go back to the intrinsics that the recording was opened with. Undo takes that back.";
  back.onclick = useGiven;
  present.replaceChildren(
    make("h2", "", "Intrinsics in use"),
    make("p", "lens-about", [make("strong", "", camera.about), ` · ${camera.model} · ${camera.size} · ${camera.field}`]),
    parameters(camera),
    make("p", "lens-note", camera.known ? "" : "No uncertainty given."),
    make("div", "acts", [rectify, save, ...(lens.chosen ? [back] : [])]),
  );
}

function drawPlots() {
  if (page.hidden || !state.lens) return;
  const { imageWidth, imageHeight } = sizeOfImage();
  drawMap(imageWidth, imageHeight);
}

/** The size of the recorded images. */
const sizeOfImage = () => ({ imageWidth: state.recording?.width_px ?? 0, imageHeight: state.recording?.height_px ?? 0 });

const lensProgress = make("section", "lens-progress", []);
const bar = make("progress", "", []);
const cancel = make("button", "second", "Cancel");
const barRow = make("div", "lens-bar", [bar, cancel]);
const words = make("p", "lens-words", "");
const missing = make("ul", "lens-missing", []);
const map = make("canvas", "lens-map", []);
const coverageRow = make("div", "lens-coverage", []);

/** @param {() => void} stop called by the button that cancels */
function startLensProgress(stop) {
  lensProgress.setAttribute("aria-label", "Progress");
  bar.setAttribute("aria-label", "Images searched");
  map.setAttribute("role", "img");
  cancel.onclick = stop;
  lensProgress.append(barRow, words, missing, coverageRow);
}

/** Whether a calibration runs. */
const running = () => state.lens?.stage === "searching" || state.lens?.stage === "calibrating";

/** Put the focus on the button that cancels. */
const focusCancel = () => cancel.focus();

/** Show the present state; the elements stay, so that a button keeps its focus. @param {import("../messages.js").LensState} lens */
function drawProgress(lens) {
  lensProgress.hidden = lens.stage === "idle" || (lens.stage === "done" && !lens.coverage);
  barRow.hidden = !running();
  if (lens.stage === "searching") [bar.max, bar.value] = [lens.total || 1, lens.searched];
  else bar.removeAttribute("value");
  words.className = `lens-words ${lens.stage}`;
  words.replaceChildren(...[progressWords(lens)].flat());
  missing.replaceChildren(...(lens.coverage?.missing ?? []).map((sentence) => make("li", "", sentence)));
  missing.hidden = !missing.childElementCount;
  coverageRow.hidden = !lens.coverage;
  if (lens.coverage) coverageRow.replaceChildren(map, tallies(lens.coverage));
}

/** Draw where the board was. @param {number} wide of an image @param {number} high */
function drawMap(wide, high) {
  const coverage = state.lens?.coverage;
  if (!coverage || !map.isConnected) return;
  drawCoverage(map, coverage, wide, high);
  map.setAttribute("aria-label", `Where the board was in the image: ${Math.round(100 * coverage.share)} % is covered`);
}

/** @param {import("../messages.js").LensState} lens @returns {string|(HTMLElement|string)[]} */
function progressWords(lens) {
  const found = `the board was found in ${lens.views} of ${lens.searched} images`;
  const sentence = found[0].toUpperCase() + found.slice(1);
  const left = lens.left_out ? `, ${lens.left_out} left out` : "";
  if (lens.stage === "searching") return lens.total ? `Searching at least ${lens.total} images: ${found}${left}.` : "Looking for the board…";
  if (lens.stage === "calibrating") return `${sentence}${left}. ${lens.doing || "Calibrating the lens"}…`;
  if (lens.stage === "cancelled") return `Cancelled: ${found}. They are kept: Resume goes on from them.`;
  if (lens.stage === "failed") return [make("strong", "", lens.problem), lens.hint ? ` ${lens.hint}` : ""];
  return `${sentence}; the result says which of them it uses.`;
}

/** @param {import("../messages.js").Coverage} coverage */
function tallies(coverage) {
  const row = (/** @type {string} */ name, /** @type {Record<string, number>} */ counts) =>
    make("div", "", [make("dt", "", name), make("dd", "", Object.entries(counts).map(([one, count]) => make("span", count ? "" : "none", `${one} ${count}`)))]);
  const share = make("div", "", [make("dt", "", "Covered"), make("dd", "", [make("span", "", `${Math.round(100 * coverage.share)} % of the image`)])]);
  return make("dl", "lens-tallies", [share, row("Turned", coverage.tilts), row("Distance", coverage.distances)]);
}
