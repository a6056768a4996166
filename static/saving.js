/** Files that the server makes, kept in the browser's folder for downloads. */
import { ask, BROKE_OFF, content } from "./asking.js";
import { make } from "./notices.js";

/** @typedef {{reason: string, isLost: boolean}} Unsaved why there is no file; `isLost` says that it is worth asking again. */

/** Fetch a file and keep it under a name. @param {string} address @param {string} name @returns {Promise<Unsaved|null>} null if it was saved */
export async function saveFile(address, name) {
  const { answer, reason, isLost } = await ask(address);
  const file = answer && (await content(answer.blob()));
  if (!file) return { reason: reason || BROKE_OFF, isLost: isLost || !reason };
  const url = URL.createObjectURL(file);
  const anchor = make("a", "", []);
  [anchor.href, anchor.download] = [url, name];
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
  return null;
}
