/**
 * Requests outside the channel: the answer, or in words why there is none, and files that are saved from one. A server that is gone is
 * an answer too.
 */

import { make } from "./notices.js";

/** @typedef {{answer: Response|null, reason: string, isLost: boolean}} Asked `isLost` says that it is worth asking again. */
/** A server that has not begun to answer by now hangs [ms]. */
const PATIENCE_MS = 20_000;
const LOST = "The server is not responding. Your clicks are safe: confirmed ones are on disk, new ones are sent when it is back.";

const ADMITTING = "The server was restarted and is letting this page in again. If that takes longer than a few seconds, open the link shown in the terminal.";

/** What is still being made is asked for again after this time [ms]. */
const AGAIN_MS = 700;

/** Ask the server. @param {string} address @param {(progress: string) => void} [tell] called while it makes the answer @returns {Promise<Asked>} */
export async function ask(address, tell) {
  try {
    const answer = await fetch(address, { signal: AbortSignal.timeout(PATIENCE_MS) });
    if (answer.status === 202) {
      tell?.(await answer.text());
      await new Promise((later) => setTimeout(later, AGAIN_MS));
      return ask(address, tell);
    }
    if (answer.ok) return { answer, reason: "", isLost: false };
    if (answer.status === 401) return { answer: null, reason: ADMITTING, isLost: true };
    const said = (await answer.text()).trim();
    return { answer: null, reason: said || `The server answered with error ${answer.status}.`, isLost: answer.status >= 500 };
  } catch {
    return { answer: null, reason: LOST, isLost: true };
  }
}

/** The content of an answer; null if the server was lost while it came. @template T @param {Promise<T>} reading @returns {Promise<T|null>} */
export async function content(reading) {
  try {
    return await reading;
  } catch {
    return null;
  }
}

/** A message of 4 MB is the limit: a larger file is not sent [bytes]. */
export const LARGEST_FILE = 2_800_000;

/** A hidden field in which a file is chosen. @param {(file: File) => unknown} take @param {string} label @returns {HTMLInputElement} */
export function fileField(take, label) {
  const field = make("input", "", []);
  field.type = "file";
  field.hidden = true;
  field.setAttribute("aria-label", label);
  field.onchange = async () => {
    if (field.files?.[0]) await take(field.files[0]);
    field.value = "";
  };
  return field;
}

/** The bytes of a file in base 64; null if they cannot be read. @param {Blob} file @returns {Promise<string|null>} */
export function inBase64(file) {
  return new Promise((ready) => {
    const reader = new FileReader();
    reader.onload = () => ready(String(reader.result).replace(/^[^,]*,/, ""));
    reader.onerror = () => ready(null);
    reader.readAsDataURL(file);
  });
}

/** Said when an answer broke off. */
export const BROKE_OFF = "The server stopped before its answer was complete. Your clicks are safe.";

/** @typedef {{reason: string, isLost: boolean}} Unsaved why there is no file; `isLost` says that it is worth asking again. */

/** Fetch a file and keep it under a name. @param {string} address @param {string} name @param {(progress: string) => void} [tell] @returns {Promise<Unsaved|null>} null if it was saved */
export async function saveFile(address, name, tell) {
  const { answer, reason, isLost } = await ask(address, tell);
  const file = answer && (await content(answer.blob()));
  if (!file) return { reason: reason || BROKE_OFF, isLost: isLost || !reason };
  const url = URL.createObjectURL(file);
  const anchor = make("a", "", []);
  [anchor.href, anchor.download] = [url, name];
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
  return null;
}
