/** What is proposed for the frame on screen: rooms below the proposals ask here, and the proposals answer. */

/** @typedef {import("../messages.js").ProposalRow} Row */
/** @typedef {import("../messages.js").ProposalPlace} Place */
/** A proposal on screen, which of its places is taken, and whether another one was asked for. @typedef {{row: Row, place: Place, number: number, isOpen: boolean}} Offer */

export const offers = {
  /** The proposal on screen. @type {() => Offer|null} */ shown: () => null,
  /** How sure the proposals are that wait for a decision, by the number of their placement. @type {() => Map<number, number>} */ confidences: () => new Map(),
  /** A click was placed while a proposal was on screen; it is being sent. @type {(offer: Offer, sending: Promise<string|null>) => void} */ clicked: () => {},
};
