/** Adding the clicks of a clicks.json that the user chooses. */

import { make, toast } from "./notices.js";
import { send } from "./socket.js";

const field = make("input", "", []);
field.type = "file";
field.accept = ".json,application/json";
field.onchange = async () => {
  const file = field.files?.[0];
  if (!file) return;
  const dialog = /** @type {HTMLDialogElement|null} */ (document.querySelector("dialog[open]"));
  dialog?.close();
  const refusal = await send({ type: "import_clicks", text: await file.text(), name: file.name });
  if (refusal) toast(refusal);
  field.value = "";
};

/** Ask for a file of clicks, and add them. */
export function loadClicks() {
  field.click();
}

/** The button of the export dialog, with the field behind it. */
export function importer() {
  const open = make("button", "second", "Load clicks…");
  open.dataset.hint = "Add the clicks from a clicks.json. In frames that already have a click, they replace it.";
  open.onclick = loadClicks;
  return make("span", "", [open, field]);
}
