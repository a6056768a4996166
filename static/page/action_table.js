/** The table of actions, once: words, keys, what runs and when it can be done. */

import { register } from "../base/actions.js";
import { closeSheet, enlargePanel, showPage, toggleTheme } from "../base/layout.js";
import { clickIn, clicks, selectedClick, state } from "../base/state.js";
import { loadClicks, openExport } from "../export/exporting.js";
import { saveCamera } from "../lens/result.js";
import { chooseRecording } from "../opening/opening.js";
import { nextWorst } from "../pairs/pairs.js";
import { toPlacement } from "../picture/arriving.js";
import { fitEye, zoomEye } from "../picture/birdseye.js";
import { choose, nextCandidate, withoutCandidates } from "../picture/candidates.js";
import { nudgeBy, removeSelected, snap, toggleExcluded, turnBack, withoutSnappable } from "../picture/clicking.js";
import { toggleContours } from "../picture/contours.js";
import { enterCross, toggleCross } from "../picture/cross.js";
import { dismissHere, withoutPlacement } from "../picture/dismissing.js";
import { magnify, stretchContrast } from "../picture/loupe.js";
import { toggleLayer } from "../picture/marks.js";
import { fit, zoomBy } from "../picture/picture.js";
import { toggleRectified, withoutRectified } from "../picture/rectified.js";
import { acceptProposal, nextPlace, nextProposal, previousProposal, rejectProposal, takesEnter, takesKeys } from "../proposals/proposals.js";
import { sayNone, toggleProposals } from "../proposals/words.js";
import { chooseBoxes, findMoving, toggleEvaluate } from "../review/evaluating.js";
import { lookFrom, setCamera, toggleHidden, toggleLarge } from "../space/space.js";
import { goLive, goTo, pause, play, step } from "../time/player.js";
import { toggleHelp } from "./help.js";
import { togglePalette } from "./palette.js";

const opened = () => (state.recording ? "" : "The recording is not open yet");
const withPictures = () => opened() || (state.looking ? "There are no pictures in this recording" : "");
const withFrames = () => opened() || (state.seconds.length > 1 ? "" : "There is only one frame");
const withPlacements = () => opened() || (state.placements.length ? "" : "No placement was found in the radar data");
const withMark = () => withPictures() || (clickIn(state.cursor) ? "" : "There is no mark in this frame");
const withSnappable = () => withPictures() || withoutSnappable();
const withSelected = () => withPictures() || (selectedClick() ? "" : "No pair is selected: go to one first");
const withResiduals = () => withPictures() || (clicks().some((click) => click.residual_px !== null) ? "" : "There is no calibration yet");
const undoable = () => withPictures() || (state.view?.can_undo ? "" : "There is nothing to undo");
const redoable = () => withPictures() || (state.view?.can_redo ? "" : "There is nothing to redo");
const following = () => (state.following && !["complete", "ended"].includes(state.following.state) ? "" : "The recording is complete: no new frames come");

/** @param {number} du @param {number} dv image px */
const nudge = (du, dv) => () => nudgeBy(du, dv);
const zoom = (/** @type {number} */ factor) => (state.looking ? zoomEye(factor) : zoomBy(factor));

const FRAMES = { help: "Step one frame", when: withFrames };
const TENS = { help: "Step ten frames", when: withFrames };
const ENDS = { help: "First or last frame", when: withFrames };
const PLACES = { help: "Next or previous placement", when: withPlacements };
const FINE = { group: "Mark", help: "Move the mark by 0.1 px", also: "nudge shift subpixel fine", when: withMark };
const COARSE = { group: "Mark", help: "Move the mark by 1 px", also: "nudge shift", when: withMark };
const ZOOM = { group: "Picture", help: "Zoom", when: opened };
const OVERLAY = { group: "Picture", help: "Toggle overlays", when: withPictures };
const SPACE = { group: "3D view", when: opened };

/** Make the actions known, in the order of the help. */
export function registerActions() {
  register(
    { id: "play", group: "Time", words: "Play or pause", keys: ["Space"], also: "start stop run video", run: () => (state.playing ? pause() : play()), when: withFrames },
    { id: "frame-back", group: "Time", words: "One frame back", keys: ["ArrowLeft"], also: "previous step", run: () => step(-1), ...FRAMES },
    { id: "frame-forward", group: "Time", words: "One frame forward", keys: ["ArrowRight"], also: "next step", run: () => step(1), ...FRAMES },
    { id: "ten-back", group: "Time", words: "Ten frames back", keys: ["Shift+ArrowLeft"], also: "previous jump rewind", run: () => step(-10), ...TENS },
    { id: "ten-forward", group: "Time", words: "Ten frames forward", keys: ["Shift+ArrowRight"], also: "next jump skip", run: () => step(10), ...TENS },
    { id: "first-frame", group: "Time", words: "Go to the first frame", keys: ["Home"], also: "start beginning", run: () => goTo(0), ...ENDS },
    { id: "last-frame", group: "Time", words: "Go to the last frame", keys: ["End"], also: "finish newest", run: () => goTo(state.seconds.length - 1), ...ENDS },
    { id: "next-placement", group: "Time", words: "Next placement", keys: ["N"], also: "reflector position forward proposal", run: () => nextProposal() || (sayNone(), toPlacement(1)), ...PLACES },
    { id: "previous-placement", group: "Time", words: "Previous placement", keys: ["P"], also: "reflector position back", run: () => previousProposal() || toPlacement(-1), ...PLACES },
    { id: "live", group: "Time", words: "Show the newest frame as it comes", also: "live follow recording now", run: goLive, when: following },

    { id: "place-mark", group: "Mark", words: "Accept what is proposed; without a proposal, mark with the keyboard's cross", keys: ["Enter"], also: "click place add confirm yes", run: () => (takesEnter() && !state.cross ? acceptProposal() : enterCross()), when: withPictures },
    { id: "cross", group: "Mark", words: "Keyboard's cross: 1 to 9 zoom into a field, arrows move it, Backspace zooms out, Esc ends", keys: ["G"], also: "grid nine fields marking without mouse", run: toggleCross, when: withPictures },
    { id: "next-candidate", group: "Mark", words: "Take another place, or with a mark another return", keys: ["C"], also: "candidate choose radar association other next", run: () => (takesKeys() ? nextPlace() : nextCandidate()), when: () => withPictures() || (takesKeys() ? "" : withoutCandidates()) },
    { id: "free-candidate", group: "Mark", words: "Automatic return", keys: ["Shift+C"], also: "candidate automatic unchoose", run: () => choose(-1), when: () => withPictures() || (selectedClick()?.chosen ? "" : "No return was chosen for this mark") },
    { id: "snap", group: "Mark", words: "Snap the mark, or the keyboard's cross, to the reflector's apex", keys: ["S"], also: "corner magnet refine subpixel image", run: snap, when: withSnappable },
    { id: "mark-left", words: "Move the mark left by 0.1 px", keys: ["Alt+ArrowLeft"], run: nudge(-0.1, 0), ...FINE },
    { id: "mark-right", words: "Move the mark right by 0.1 px", keys: ["Alt+ArrowRight"], run: nudge(0.1, 0), ...FINE },
    { id: "mark-up", words: "Move the mark up by 0.1 px", keys: ["Alt+ArrowUp"], run: nudge(0, -0.1), ...FINE },
    { id: "mark-down", words: "Move the mark down by 0.1 px", keys: ["Alt+ArrowDown"], run: nudge(0, 0.1), ...FINE },
    { id: "mark-left-1", words: "Move the mark left by 1 px", keys: ["Alt+Shift+ArrowLeft"], run: nudge(-1, 0), ...COARSE },
    { id: "mark-right-1", words: "Move the mark right by 1 px", keys: ["Alt+Shift+ArrowRight"], run: nudge(1, 0), ...COARSE },
    { id: "mark-up-1", words: "Move the mark up by 1 px", keys: ["Alt+Shift+ArrowUp"], run: nudge(0, -1), ...COARSE },
    { id: "mark-down-1", words: "Move the mark down by 1 px", keys: ["Alt+Shift+ArrowDown"], run: nudge(0, 1), ...COARSE },
    { id: "delete", group: "Mark", words: "Delete the click", keys: ["Delete", "Backspace"], also: "remove mark erase", run: removeSelected, when: withSelected },
    { id: "undo", group: "Mark", words: "Undo", keys: ["Ctrl+Z"], also: "back revert take back", run: () => turnBack("undo"), when: undoable },
    { id: "redo", group: "Mark", words: "Redo", keys: ["Ctrl+Shift+Z", "Ctrl+Y"], also: "again repeat", run: () => turnBack("redo"), when: redoable },

    { id: "proposals", group: "Mark", words: "Suggestions on or off", keys: ["O"], also: "automatic find suggest off on switch", run: toggleProposals, when: withPictures },

    { id: "worst", group: "Pairs", words: "Next worst pair", keys: ["J"], also: "outlier residual largest wrong bad", run: nextWorst, when: withResiduals },
    { id: "exclude", group: "Pairs", words: "No: exclude the pair, or include it again; without a mark, dismiss the placement", keys: ["X"], also: "leave out use ignore disable spurious", run: () => (takesKeys() ? rejectProposal() : clickIn(state.cursor) ? toggleExcluded() : dismissHere()), when: () => withPictures() || (takesKeys() ? "" : clickIn(state.cursor) ? withSelected() : withoutPlacement()) },

    { id: "fit", group: "Picture", words: "Fit the picture", keys: ["F"], also: "zoom reset whole 100", run: () => (state.looking ? fitEye() : fit()), when: opened },
    { id: "zoom-in", words: "Zoom in", keys: ["+", "="], also: "magnify closer larger", run: () => zoom(1.25), ...ZOOM },
    { id: "zoom-out", words: "Zoom out", keys: ["-"], also: "smaller farther", run: () => zoom(0.8), ...ZOOM },
    { id: "show-returns", words: "Show or hide the radar returns", keys: ["1"], also: "overlay layer points dots", run: () => toggleLayer("returns"), ...OVERLAY },
    { id: "show-clicks", words: "Show or hide the clicks of other frames", keys: ["2"], also: "overlay layer marks all", run: () => toggleLayer("others"), ...OVERLAY },
    { id: "show-ellipses", words: "Show or hide the 95 % ellipses", keys: ["3"], also: "overlay layer uncertainty covariance", run: () => toggleLayer("ellipses"), ...OVERLAY },
    { id: "show-predictions", words: "Show or hide the expected positions", keys: ["4"], also: "overlay layer predicted guess next placement", run: () => toggleLayer("predictions"), ...OVERLAY },
    { id: "show-uncertainty", words: "Show or hide the uncertainty in the picture", keys: ["5"], also: "overlay layer contours map 95 % lines", run: toggleContours, ...OVERLAY },
    { id: "rectify", group: "Picture", words: "Show the picture rectified, or as taken; drag lines along straight edges", keys: ["U"], also: "undistort distortion lens straight ruler grid intrinsics", run: toggleRectified, when: () => withPictures() || withoutRectified() },
    { id: "loupe-more", group: "Picture", words: "Loupe: magnify more", keys: ["]"], help: "Loupe: 4 to 16 times", also: "zoom magnifier larger", run: () => magnify(1), when: withPictures },
    { id: "loupe-less", group: "Picture", words: "Loupe: magnify less", keys: ["["], help: "Loupe: 4 to 16 times", also: "zoom magnifier smaller", run: () => magnify(-1), when: withPictures },
    { id: "loupe-contrast", group: "Picture", words: "Loupe: stretch the contrast, or not", keys: ["L"], also: "magnifier brightness enhance dark", run: stretchContrast, when: withPictures },

    { id: "view-behind", words: "3D: look from behind the radar", also: "viewpoint", run: () => lookFrom("behind"), ...SPACE },
    { id: "view-above", words: "3D: look down from above", also: "viewpoint top bird", run: () => lookFrom("above"), ...SPACE },
    { id: "view-side", words: "3D: look from the side", also: "viewpoint right", run: () => lookFrom("side"), ...SPACE },
    { id: "view-camera", words: "3D: look from the camera, over its picture", also: "viewpoint overlay reprojection", run: () => setCamera(true), group: "3D view", when: withPictures },
    { id: "space-hide", words: "Hide or show the 3D view", keys: ["V"], also: "3D close", run: () => toggleHidden(), ...SPACE },
    { id: "space-large", words: "Enlarge the 3D view, or give the picture its place back", keys: ["B"], also: "3D big maximize full", run: () => toggleLarge(), ...SPACE },

    { id: "mark", group: "Panel", words: "Mark: the pairs and the returns that each may use", also: "tab table list clicks placements candidates", run: () => showPage("mark") },
    { id: "check", group: "Panel", words: "Check: the pose, the review of all pairs, and two solutions compared", also: "tab transform extrinsics rotation translation errors advice plots residuals histogram influence rms cdsd a b", run: () => showPage("check"), when: withPictures },
    { id: "deliver", group: "Panel", words: "Deliver", also: "tab save download file export report clicks", run: () => showPage("deliver"), when: withPictures },
    { id: "evaluate", group: "Panel", words: "Evaluate: judge the calibration by boxes around what moves, or go back", keys: ["A"], also: "sheet boxes annotations acc accuracy bounding people cars moving", run: toggleEvaluate, when: withPictures },
    { id: "find-moving", group: "Panel", words: "Evaluate: find what moves before a camera that stands still", also: "boxes motion detect", run: findMoving, when: withPictures },
    { id: "lens", group: "Panel", words: "Lens: intrinsics, and calibrating them from a board", also: "sheet camera intrinsics checkerboard charuco aprilgrid calibrate focal length distortion", run: () => showPage("lens"), when: withPictures },
    { id: "options", group: "Panel", words: "Options", also: "sheet settings parameters method", run: () => showPage("options"), when: withPictures },
    { id: "close-sheet", group: "Panel", words: "Close the sheet: go back to the tab before", also: "leave evaluate lens options", run: closeSheet },
    { id: "enlarge-panel", group: "Panel", words: "Enlarge the panel, or give the 3D view its place back", also: "tab plots large column", run: enlargePanel },
    { id: "theme", group: "Panel", words: "Light or dark theme", also: "colours colors bright night mode", run: toggleTheme },

    { id: "export", group: "File", words: "Export the calibration or the clicks", keys: ["E"], also: "save download write file json yaml urdf tf format", run: () => openExport(), when: withPictures },
    { id: "recording", group: "File", words: "Choose another recording, other topics, intrinsics or session", also: "open file folder recent camera radar topic intrinsics", run: chooseRecording },
    { id: "save-camera", group: "File", words: "Save the intrinsics in use as camera.yaml", also: "export download camera_info lens", run: () => saveCamera(true), when: () => withPictures() || (state.lens?.intrinsics ? "" : "There are no intrinsics yet") },
    { id: "load-clicks", group: "File", words: "Load clicks from a file", also: "import open clicks.json", run: loadClicks, when: withPictures },
    { id: "load-boxes", group: "File", words: "Load boxes from a file", also: "import open coco yolo cvat kitti openlabel annotations", run: chooseBoxes, when: withPictures },

    { id: "palette", group: "Help", words: "Search for an action, placement, pair or option", keys: ["Ctrl+K"], also: "command palette find go to", run: togglePalette },
    { id: "help", group: "Help", words: "Help", keys: ["?"], also: "keys mouse marks shortcuts legend manual", run: () => toggleHelp() },
  );
}
