/** Search by words: how well a query fits what an entry is called, or other words for it. */

/** @typedef {{words: string, also?: string}} Searchable */
/** A query word this short must start or be part of a word; longer ones may leave out letters or have one wrong. */
const LOOSE_FROM = 3;
/** How much a word fits less when it is only another word for the entry. */
const OTHER_WORD = 0.55;

/** How well a query fits: 0 if one of its words does not fit at all. @param {string} query @param {Searchable} entry */
export function fitOf(query, entry) {
  const parts = wordsOf(query);
  const [own, others] = [namesOf(entry.words), namesOf(entry.also ?? "")];
  let total = 0;
  for (const part of parts) {
    const fit = Math.max(best(part, own), OTHER_WORD * best(part, others));
    if (!fit) return 0;
    total += fit;
  }
  const startsAlike = entry.words.toLowerCase().startsWith(query.trim().toLowerCase()) ? 1 : 0;
  return total / Math.max(parts.length, 1) + startsAlike - 0.01 * own.length;
}

/** @param {string} text */
const wordsOf = (text) => text.toLowerCase().match(/[\p{L}\p{N}.%_+]+/gu) ?? [];

/** The words, and each with the number after it: "ROS 2" is also found as "ros2". @param {string} text */
const namesOf = (text) => wordsOf(text).flatMap((word, index, all) => (/^\d+$/.test(all[index + 1] ?? "") ? [word, word + all[index + 1]] : [word]));

/** @param {string} part @param {string[]} words */
const best = (part, words) => words.reduce((most, word) => Math.max(most, fitOfWord(part, word)), 0);

/** @param {string} part of the query @param {string} word */
function fitOfWord(part, word) {
  if (part === word) return 10;
  if (word.startsWith(part)) return 8;
  if (/\d/.test(part)) return 0; // another number is another place
  if (word.includes(part)) return 5;
  if (part.length < LOOSE_FROM) return 0;
  if (part[0] === word[0] && isWithin(part, word)) return 3;
  return part.length > LOOSE_FROM && isOneEditFrom(part, word.slice(0, part.length)) ? 2 : 0;
}

/** Whether the letters come in this order. @param {string} part @param {string} word */
function isWithin(part, word) {
  let at = 0;
  for (const letter of word) if (letter === part[at]) at += 1;
  return at === part.length;
}

/** Whether one letter is wrong, or two neighbours are swapped. @param {string} part @param {string} word */
function isOneEditFrom(part, word) {
  if (part.length !== word.length) return false;
  const wrong = [...part].flatMap((letter, index) => (letter === word[index] ? [] : [index]));
  if (wrong.length === 1) return true;
  const [first, second] = wrong;
  return wrong.length === 2 && second === first + 1 && part[first] === word[second] && part[second] === word[first];
}
