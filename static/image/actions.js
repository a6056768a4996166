/** The actions of the image: placements, marks, and what is shown. */

import { opened, register, withImages } from "../base/actions.js";
import { clickIn, selectedClick, state } from "../base/state.js";
import { toPlacement } from "./arriving.js";
import { choose, keepCandidate, nextCandidate, withoutCandidates } from "./candidates.js";
import { nudgeBy, removeSelected, snap, turnBack, withoutSnappable } from "./clicking.js";
import { toggleContours } from "./contours.js";
import { enterCross, toggleCross } from "./cross.js";
import { magnify, stretchContrast } from "./loupe.js";
import { toggleLayer } from "./marks.js";
import { fit, zoomBy } from "./image.js";
import { toggleRectified, withoutRectified } from "./rectified.js";

const withPlacements = () => opened() || (state.placements.length ? "" : "No placement was found in the radar data");
const withMark = () => withImages() || (clickIn(state.cursor) ? "" : "There is no mark in this frame");
const withSnappable = () => withImages() || withoutSnappable();
/** Why nothing can be done with the selected pair; "" if it can. */
export const withSelected = () => withImages() || (selectedClick() ? "" : "No pair is selected: go to one first");
const undoable = () => withImages() || (state.view?.can_undo ? "" : "There is nothing to undo");
const redoable = () => withImages() || (state.view?.can_redo ? "" : "There is nothing to redo");

/** Without a proposal: set the mark of the keyboard's cross, keep the return that is asked about, or go on. */
function enter() {
  if (state.cross) return enterCross(state.cross);
  if (!keepCandidate() && !withPlacements()) toPlacement(1);
}

/** @param {number} du @param {number} dv image px */
const nudge = (du, dv) => () => nudgeBy(du, dv);

const PLACES = { help: "Next or previous placement", when: withPlacements };
const FINE = { group: "Mark", help: "Move the mark by 0.1 px", also: "nudge shift subpixel fine", when: withMark };
const COARSE = { group: "Mark", help: "Move the mark by 1 px", also: "nudge shift", when: withMark };
const ZOOM = { group: "Image", help: "Zoom", when: opened };
const OVERLAY = { group: "Image", help: "Toggle overlays", when: withImages };

/** Make them known. */
export function registerImage() {
  register(
    { id: "next-placement", group: "Time", words: "Next placement", keys: ["N"], also: "reflector position forward proposal", run: () => toPlacement(1), ...PLACES },
    { id: "previous-placement", group: "Time", words: "Previous placement", keys: ["P"], also: "reflector position back", run: () => toPlacement(-1), ...PLACES },

    { id: "place-mark", group: "Mark", words: "Accept, keep the return that is shown, or go on", keys: ["Enter"], also: "click place add confirm yes mark", run: enter, when: withImages },
    { id: "cross", group: "Mark", words: "Keyboard's cross: 1 to 9 zoom into a field, arrows move it, Backspace zooms out, Esc ends", keys: ["G"], also: "grid nine fields marking without mouse", run: toggleCross, when: withImages },
    { id: "next-candidate", group: "Mark", words: "Take another spot, or with a mark another return", keys: ["C"], also: "candidate choose radar association other next", run: nextCandidate, when: () => withImages() || withoutCandidates() },
    { id: "free-candidate", group: "Mark", words: "Automatic return", keys: ["Shift+C"], also: "candidate automatic unchoose", run: () => choose(-1), when: () => withImages() || (selectedClick()?.chosen ? "" : "No return was chosen for this mark") },
    { id: "snap", group: "Mark", words: "Snap the mark, or the keyboard's cross, to the inner corner", keys: ["S"], also: "corner magnet refine subpixel image", run: snap, when: withSnappable },
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

    { id: "fit", group: "Image", words: "Fit the image", keys: ["F"], also: "zoom reset whole 100", run: fit, when: opened },
    { id: "zoom-in", words: "Zoom in", keys: ["+", "="], also: "magnify closer larger", run: () => zoomBy(1.25), ...ZOOM },
    { id: "zoom-out", words: "Zoom out", keys: ["-"], also: "smaller farther", run: () => zoomBy(0.8), ...ZOOM },
    { id: "show-returns", words: "Show or hide the radar returns", keys: ["1"], also: "overlay layer points dots", run: () => toggleLayer("returns"), ...OVERLAY },
    { id: "show-clicks", words: "Show or hide the clicks of other frames", keys: ["2"], also: "overlay layer marks all", run: () => toggleLayer("others"), ...OVERLAY },
    { id: "show-ellipses", words: "Show or hide the 95 % ellipses", keys: ["3"], also: "overlay layer uncertainty covariance", run: () => toggleLayer("ellipses"), ...OVERLAY },
    { id: "show-predictions", words: "Show or hide the expected positions", keys: ["4"], also: "overlay layer predicted guess next placement", run: () => toggleLayer("predictions"), ...OVERLAY },
    { id: "show-uncertainty", words: "Show or hide the uncertainty in the image", keys: ["5"], also: "overlay layer contours map 95 % lines", run: toggleContours, ...OVERLAY },
    { id: "rectify", group: "Image", words: "Show the image rectified, or as taken; drag lines along straight edges", keys: ["U"], also: "undistort distortion lens straight ruler grid intrinsics", run: toggleRectified, when: () => withImages() || withoutRectified() },
    { id: "loupe-more", group: "Image", words: "Loupe: magnify more", keys: ["]"], help: "Loupe: 4 to 16 times", also: "zoom magnifier larger", run: () => magnify(1), when: withImages },
    { id: "loupe-less", group: "Image", words: "Loupe: magnify less", keys: ["["], help: "Loupe: 4 to 16 times", also: "zoom magnifier smaller", run: () => magnify(-1), when: withImages },
    { id: "loupe-contrast", group: "Image", words: "Loupe: stretch the contrast, or not", keys: ["L"], also: "magnifier brightness enhance dark", run: stretchContrast, when: withImages },
  );
}
