/** Which return a pair uses and why, in the server's words: its figures, and all returns that were possible. */

import { make } from "./notices.js";

/** @param {import("./messages.js").PairReview} pair @returns {HTMLElement[]} */
export function pairParts(pair) {
  const facts = pair.facts.map((fact) => {
    const box = make("div", "", [make("dt", "", fact.label), make("dd", "", fact.value)]);
    box.dataset.hint = fact.hint;
    return box;
  });
  const heads = ["used", "range", "direction", "score", "SNR", "returns in scans", "from the click"];
  const head = make("tr", "", heads.map((name) => {
    const cell = make("th", "", name);
    cell.scope = "col";
    return cell;
  }));
  const lines = pair.candidates.map((one) => {
    const mark = make("td", "", one.chosen ? "●" : "○");
    mark.setAttribute("aria-label", one.chosen ? "used" : "not used");
    return make("tr", one.chosen ? "chosen" : "", [mark, ...[one.range, one.direction, one.score, one.snr, one.seen, one.distance].map((text) => make("td", "", text))]);
  });
  const scroll = make("div", "review-scroll", [make("table", "review-candidates", [make("thead", "", [head]), make("tbody", "", lines)])]);
  scroll.tabIndex = 0; // a narrow panel scrolls it
  scroll.setAttribute("role", "region");
  scroll.setAttribute("aria-label", `Returns that ${pair.id} may use`);
  return [make("h2", "", `Pair ${pair.id}`), make("p", "", pair.why), make("dl", "", facts), ...(pair.candidates.length ? [scroll] : [])];
}
