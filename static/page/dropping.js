/** Files dropped anywhere on the page: the server says what one is, and the room that takes such files gets it. */

import { inBase64, LARGEST_FILE } from "../base/asking.js";
import { showPage } from "../base/layout.js";
import { toast } from "../base/notices.js";
import { send } from "../base/socket.js";
import { state } from "../base/state.js";
import { takeClicks } from "../export/exporting.js";
import { give } from "../opening/opening.js";
import { takeFile } from "../review/compare.js";
import { takeBoxes } from "../review/evaluating.js";

/** Of a larger file than can be sent, so much says whether it is a recording [bytes]. */
const BEGINNING = 65_536;
/** @type {Record<import("../messages.js").Dropped["kind"], (file: File) => void>} */
const TAKERS = {
  camera: give,
  clicks: takeClicks,
  calibration: (file) => (showPage("check"), takeFile(file)),
  boxes: (file) => (showPage("evaluate"), takeBoxes(file)),
};
/** @type {File|null} */
let dropped = null;

export function startDropping() {
  const listen = (/** @type {"dragover"|"drop"} */ type, /** @type {(files: FileList) => void} */ take) =>
    addEventListener(type, (event) => {
      if (!event.dataTransfer?.types.includes("Files")) return;
      event.preventDefault();
      document.body.classList.toggle("dropping", type === "dragover");
      take(event.dataTransfer.files);
    });
  listen("dragover", () => {});
  listen("drop", (files) => files[0] && ask(files[0]));
  addEventListener("dragleave", () => document.body.classList.remove("dropping"));
}

/** Ask what a file is; before a recording is open, only a camera's can be used. @param {File} file */
async function ask(file) {
  if (!state.recording) return give(file);
  const isWhole = file.size <= LARGEST_FILE;
  const content = await inBase64(isWhole ? file : file.slice(0, BEGINNING));
  if (content === null) return toast(`${file.name} cannot be read by the browser; a folder cannot be dropped.`, "Choose the file itself.");
  dropped = file;
  const refusal = await send({ type: "file_dropped", name: file.name, content_base64: content, is_whole: isWhole });
  if (refusal) toast(refusal);
}

/** Give the file to whoever takes such files. @param {import("../messages.js").Dropped} message */
export function takeDropped({ kind }) {
  if (dropped) TAKERS[kind](dropped);
  dropped = null;
}
