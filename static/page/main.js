/** The page: wires the modules together and passes the server's messages to those that draw them. */

import { act, actionNamed } from "../base/actions.js";
import { ask, content } from "../base/asking.js";
import { startLayout } from "../base/layout.js";
import { setBanner, startTips, toast } from "../base/notices.js";
import { connect, tell, unconfirmed } from "../base/socket.js";
import { clickIn, clicks, clicksIn, emit, Follower, on, select, selectedClick, stampOf, state } from "../base/state.js";
import { startExporting } from "../export/exporting.js";
import { startLens, takeLens, takeResult } from "../lens/lens.js";
import { startLensResult } from "../lens/result.js";
import { isAnother, startOpening, takeChoices, takeFolder } from "../opening/opening.js";
import { startOptions } from "../options/options.js";
import { startFigures, startVerdict } from "../pairs/figures.js";
import { startGuide } from "../pairs/guide.js";
import { startPairs } from "../pairs/pairs.js";
import { startScatter } from "../pairs/scatter.js";
import { startWarnings } from "../pairs/warnings.js";
import { registerImage } from "../image/actions.js";
import { startArriving } from "../image/arriving.js";
import { startLooking } from "../image/birdseye.js";
import { startCandidates, take as takeCandidates } from "../image/candidates.js";
import { startClicking, takeSnapped } from "../image/clicking.js";
import { startContours, takeUncertainty } from "../image/contours.js";
import { startCross } from "../image/cross.js";
import { onImage, toCss, toImage, viewport, zoom } from "../image/geometry.js";
import { startInset } from "../image/inset.js";
import { startLoupe } from "../image/loupe.js";
import { startLayers } from "../image/marks.js";
import { startDescribing, startImage } from "../image/image.js";
import { startRectified } from "../image/rectified.js";
import { startTouch } from "../image/touch.js";
import { justMoved, shownOffer, startProposals, takeProposals } from "../proposals/proposals.js";
import { startSwitch as startProposalSwitch } from "../proposals/words.js";
import { startCompare, takeCompared } from "../review/compare.js";
import { startEvaluating, takeAcc } from "../review/evaluating.js";
import { plots, startReview, takePair, takeReview } from "../review/review.js";
import { startSpace, takeSpace } from "../space/space.js";
import { activity, startImageChanges } from "../time/lanes.js";
import { frameFailed, goTo, receiveFrame, registerTime, requestAgain, startLive, takeFollowing, takeFrames, tellCursor } from "../time/player.js";
import { startTimeline } from "../time/timeline.js";
import { startDropping, takeDropped } from "./dropping.js";
import { startHelp } from "./help.js";
import { listen, startRoving } from "./keys.js";
import { startPalette } from "./palette.js";
import { startStatus } from "./status.js";

const follower = new Follower();

/** @type {Record<string, (message: any) => void>} */
const readers = {
  opening(message) {
    state.opening = message;
    setBanner(message.problem);
    emit("opening");
  },
  opening_choices: takeChoices,
  folder_listing: takeFolder,
  recording: takeRecording,
  view(message) {
    follower.take(message);
    takeView();
  },
  view_change(message) {
    if (follower.follow(message)) takeView();
    else tell({ type: "view" });
  },
  frames_added: takeFrames,
  following: takeFollowing,
  placements(message) {
    state.placements = message.placements;
    state.placementSummary = message.summary;
    state.placementFigures = message.figures;
    state.placementsKnown = true;
    emit("placements");
    loadActivity();
  },
  overlay(message) {
    state.overlay = message;
    emit("overlay");
  },
  acc: takeAcc,
  radar_look(message) {
    state.look = message;
    emit("look");
  },
  radar_map(message) {
    state.radarMap = message;
    emit("radar_map");
  },
  candidates(message) {
    takeCandidates(message);
  },
  space: takeSpace,
  progress(message) {
    state.progress = message;
    emit("progress");
  },
  review: takeReview,
  pair_review: takePair,
  compared: takeCompared,
  uncertainty: takeUncertainty,
  lens: takeLens,
  proposals: takeProposals,
  lens_result: takeResult,
  snapped: takeSnapped,
  dropped: takeDropped,
  error(message) {
    toast(message.message, message.hint);
    frameFailed(message.request);
  },
};

function takeView() {
  state.view = follower.view;
  emit("view");
  if (state.selected && !selectedClick()) select(null);
  const here = clickIn(state.shown?.index ?? -1);
  if (here?.id && !state.selected) select(here.id);
}

/** @param {import("../messages.js").RecordingNote} message */
function takeRecording(message) {
  if (isAnother(message)) return;
  const same = state.recording !== null;
  state.recording = message;
  state.opening = null;
  state.looking = !message.has_images;
  const { sec, nanosec } = message.frame_times;
  state.seconds = Float64Array.from(sec, (value, index) => value - sec[0] + (nanosec[index] - nanosec[0]) * 1e-9);
  document.title = `${message.name} · cocalib`;
  emit("opening");
  emit("recording");
  if (message.session.note) toast(message.session.note);
  if (same) requestAgain();
  else goTo(firstFrame());
}

/** The frame to start with: after a reload, the one shown before. */
function firstFrame() {
  const kept = Number(sessionStorage.getItem("cocalib-frame") ?? 0);
  return Number.isInteger(kept) && kept < state.seconds.length ? kept : 0;
}

async function loadActivity() {
  const { answer } = await ask("api/activity.json");
  const found = answer && (await content(answer.json()));
  if (!found) return;
  Object.assign(activity, found);
  emit("lanes");
}

registerTime();
registerImage();
startLayout();
startTips();
startStatus();
startImage();
startLayers();
startProposalSwitch();
startProposals();
startLoupe();
startInset();
startLive();
startClicking();
startTouch();
startCandidates();
startCross();
startTimeline();
startImageChanges();
startPairs();
startVerdict();
startFigures();
startScatter();
startReview();
startCompare();
startContours();
startEvaluating();
startLens();
startLensResult();
startRectified();
startOptions();
startExporting();
startGuide();
startPalette();
startHelp();
startRoving();
startDescribing();
startArriving();
startLooking();
startOpening();
startDropping();
startWarnings();
listen(window);
for (const button of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("[data-action]"))) button.addEventListener("click", () => act(actionNamed(button.dataset.action ?? "")));
on(["cursor"], () => sessionStorage.setItem("cocalib-frame", String(state.cursor)));
on(["selected", "theme"], tellCursor);
connect({
  message: (message) => readers[message.type]?.(message),
  frame: receiveFrame,
  connection(connected) {
    state.connected = connected;
    const why = state.opening?.problem || "The server is not responding. Clicks are kept here and sent when it is back.";
    setBanner(connected ? "" : why);
    emit("connection");
  },
});
startSpace(listen);

/** Exposed for the browser tests. */
Object.assign(window, {
  __cocalib: { state, viewport, zoom, toCss, toImage, onImage, clicks, clickIn, clicksIn, goTo, unconfirmed, follower, plots, shownOffer, justMoved, stampOf },
});
