// @ts-check
/** The export menu: the calibration in every format, the clicks, and clicks from a file. */

import { make, toast } from "./notices.js";
import { send } from "./socket.js";
import { on, state } from "./state.js";

const button = /** @type {HTMLButtonElement} */ (document.getElementById("export"));
const menu = /** @type {HTMLElement} */ (document.getElementById("export-menu"));
/** @type {{key: string, label: string, hint: string}[]} */
let formats = [];

export function startMenus() {
  button.onclick = () => (menu.hidden ? open() : close());
  addEventListener("pointerdown", (event) => {
    const target = /** @type {Node} */ (event.target);
    if (!menu.contains(target) && !button.contains(target)) close();
  });
  menu.addEventListener("keydown", moveFocus);
  on(["view"], () => button.classList.toggle("ready", state.view?.has_calibration ?? false));
}

/** The formats that the server can write. @param {typeof formats} given */
export function setFormats(given) {
  formats = given;
}

function open() {
  const ready = state.view?.has_calibration ?? false;
  const items = [
    ...(ready ? [] : [make("div", "reason", "The calibration appears after four placements; the clicks can be saved at any time.")]),
    link("api/calibration.json", "Calibration", "calibration.json: pose, covariance, pairs, provenance", ready),
    ...formats.map((format) => link(`api/export/${encodeURIComponent(format.key)}`, format.label, format.hint, ready)),
    make("hr", "", []),
    link("api/clicks.json", "Clicks", "clicks.json: to go on with elsewhere, or for cocalib solve", true),
    importer(),
  ];
  items.find((item) => item instanceof HTMLAnchorElement)?.classList.add("first");
  menu.replaceChildren(...items);
  menu.hidden = false;
  button.setAttribute("aria-expanded", "true");
  /** @type {HTMLElement|null} */ (menu.querySelector("a:not([aria-disabled=true])"))?.focus();
}

export function close() {
  if (menu.hidden) return;
  menu.hidden = true;
  button.setAttribute("aria-expanded", "false");
  if (menu.contains(document.activeElement)) button.focus();
}

/** @param {string} href @param {string} label @param {string} hint @param {boolean} ready */
function link(href, label, hint, ready) {
  const item = make("a", "", [label, make("small", "", hint)]);
  item.setAttribute("role", "menuitem");
  item.dataset.export = href;
  item.tabIndex = 0;
  if (!ready) item.setAttribute("aria-disabled", "true");
  item.onclick = () => download(href);
  item.onkeydown = (event) => {
    if (event.key === "Enter" || event.key === " ") download(href);
  };
  return item;
}

/** Fetch a file and hand it to the browser; a refusal is shown in words. @param {string} href */
async function download(href) {
  close();
  const answer = await fetch(href);
  if (!answer.ok) return toast(await answer.text());
  const name = /filename="([^"]+)"/.exec(answer.headers.get("Content-Disposition") ?? "")?.[1] ?? "download";
  const address = URL.createObjectURL(await answer.blob());
  const anchor = make("a", "", []);
  [anchor.href, anchor.download] = [address, name];
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}

function importer() {
  const input = make("input", "", []);
  input.type = "file";
  input.accept = ".json,application/json";
  input.onchange = async () => {
    const file = input.files?.[0];
    if (!file) return;
    close();
    const refusal = await send({ type: "import_clicks", text: await file.text(), name: file.name });
    if (refusal) toast(refusal);
  };
  const label = make("label", "", ["Load clicks…", make("small", "", "clicks.json joins what is here"), input]);
  label.tabIndex = 0;
  label.setAttribute("role", "menuitem");
  return label;
}

/** @param {KeyboardEvent} event */
function moveFocus(event) {
  const items = /** @type {HTMLElement[]} */ ([...menu.querySelectorAll("[role=menuitem]:not([aria-disabled=true])")]);
  const at = items.indexOf(/** @type {HTMLElement} */ (document.activeElement));
  if (event.key === "ArrowDown") items[(at + 1) % items.length]?.focus();
  else if (event.key === "ArrowUp") items[(at - 1 + items.length) % items.length]?.focus();
  else return;
  event.preventDefault();
  event.stopPropagation();
}
