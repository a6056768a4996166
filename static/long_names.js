/** Names of any length and script: cut in the middle where there is no room, in full on hover. */

import { make } from "./notices.js";

/** This much of a long name's end always stays: what tells two topics of one sensor apart. */
const KEPT_END = 14;
/** A name of at most this many characters is cut at its end only. */
const SHORT = 28;
/** Right-to-left letters: a name with them is cut at its end only, since parts of mixed directions would change places. */
const RIGHT_TO_LEFT = /[\p{Script=Arabic}\p{Script=Hebrew}\p{Script=Syriac}\p{Script=Thaana}\p{Script=Nko}]/u;

/** A name in two parts, of which the first gives way. @param {string} name */
export function longName(name) {
  const made = make("span", "long-name", parts(name));
  made.dir = "auto"; // a right-to-left name keeps its own order, and its neighbours theirs
  return made;
}

/** Show a name in an element that is there already, and all of it on hover. @param {HTMLElement} owner @param {string} name */
export function setLongName(owner, name) {
  owner.classList.add("long-name");
  owner.dir = "auto";
  owner.replaceChildren(...parts(name));
  owner.dataset.hint = name;
}

/** @param {string} name */
function parts(name) {
  const letters = Array.from(new Intl.Segmenter().segment(name), ({ segment }) => segment); // never within a letter and its accents
  if (letters.length <= SHORT || RIGHT_TO_LEFT.test(name)) return [make("span", "", name)];
  const cut = letters.length - KEPT_END;
  return [make("span", "", letters.slice(0, cut).join("")), make("span", "", letters.slice(cut).join(""))];
}
