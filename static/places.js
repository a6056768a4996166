/** What can be gone to by typing: placements, pairs, frames, times, and the options of the panel. */

import { comeTo } from "./arriving.js";
import { openOption, optionRows } from "./options.js";
import { goTo, nearestIndex, pause } from "./player.js";
import { clicks, isClicked, select, state } from "./state.js";

/**
 * A row of the palette.
 * @typedef {object} Entry
 * @property {string} id
 * @property {string} group
 * @property {string} words
 * @property {string} [detail] What it is now.
 * @property {string} [also]
 * @property {string[]} [keys]
 * @property {string} reason Why it cannot be done now, "" if it can.
 * @property {() => unknown} run
 */

/** Placements and pairs, and the options. @returns {Entry[]} */
export const places = () => [...placements(), ...pairs(), ...options()];

/** @returns {Entry[]} */
function placements() {
  const count = state.placements.length;
  return state.placements.map((placement, index) => ({
    id: `placement:${index + 1}`,
    group: "Placement",
    words: `Placement ${index + 1}`,
    detail: `${(state.seconds[placement.frame] ?? 0).toFixed(1)} s, ${placement.range_m.toFixed(1)} m away${state.looking || isClicked(placement) ? "" : ", no click yet"}`,
    also: `of ${count} reflector`,
    reason: "",
    run: () => comeTo(placement.frame),
  }));
}

/** @returns {Entry[]} */
function pairs() {
  return clicks().filter((click) => click.id).map((click) => {
    const residual = click.residual_px === null ? click.state : `${click.residual_px.toFixed(1)} px${click.state === "inlier" ? "" : `, ${click.state}`}`;
    return {
      id: `pair:${click.id}`,
      group: "Pair",
      words: `Pair ${click.id}`,
      detail: [`${(state.seconds[click.frame] ?? 0).toFixed(1)} s`, click.range_m === null ? "" : `${click.range_m.toFixed(1)} m`, residual].filter(Boolean).join(", "),
      also: `click mark ${click.id.replace(/\D/g, "")} ${click.state}`,
      reason: "",
      run: () => {
        comeTo(click.frame);
        select(click.id);
      },
    };
  });
}

/** @returns {Entry[]} */
function options() {
  if (state.looking) return [];
  return optionRows().map(({ path, label, value, reason, also }) => ({
    id: `option:${path}`, group: "Option", words: label, detail: value, also, reason, run: () => openOption(path),
  }));
}

/** A placement or pair that was typed but is not there. @param {string} query @returns {Entry[]} */
function missing(query) {
  const typed = /^(placement|pair)\s*c?(\d+)$/i.exec(query.trim());
  if (!typed) return [];
  const [isPair, number] = [typed[1].toLowerCase() === "pair", Number(typed[2])];
  const known = isPair ? clicks().some((click) => click.id === `c${number}`) : number >= 1 && number <= state.placements.length;
  if (known) return [];
  const many = isPair ? clicks().length : state.placements.length;
  const reason = `There ${many === 1 ? "is 1" : `are ${many || "no"}`} ${isPair ? "pair" : "placement"}${many === 1 ? "" : "s"}`;
  return [{ id: "missing", group: isPair ? "Pair" : "Placement", words: isPair ? `Pair c${number}` : `Placement ${number}`, reason, run: () => {} }];
}

/** Frames and times that were typed: "frame 300", "time 12.5", "12.5 s", or only a number. @param {string} query @returns {Entry[]} */
export function typedPlaces(query) {
  return [...missing(query), ...moments(query)];
}

/** @param {string} query @returns {Entry[]} */
function moments(query) {
  const typed = /^(?:(frame|f|time|t|at)\s*)?(\d+(?:[.,]\d+)?)\s*(s|sec|seconds)?$/i.exec(query.trim());
  if (!typed || !state.seconds.length) return [];
  const value = Number(typed[2].replace(",", "."));
  const isTime = /^(t|time|at)$/i.test(typed[1] ?? "") || typed[3] !== undefined;
  const isFrame = /^f/i.test(typed[1] ?? "");
  return [...(isTime || !Number.isInteger(value) ? [] : [frame(value)]), ...(isFrame ? [] : [time(value)])];
}

/** @param {number} number as shown below the clock, from 1 @returns {Entry} */
function frame(number) {
  const count = state.seconds.length;
  const seconds = state.seconds[number - 1];
  const reason = seconds === undefined ? `The recording has frames 1 to ${count}` : "";
  return { id: "frame", group: "Time", words: `Frame ${number}`, detail: seconds === undefined ? "" : `${seconds.toFixed(2)} s`, reason, run: () => go(number - 1) };
}

/** @param {number} seconds @returns {Entry} */
function time(seconds) {
  const last = state.seconds[state.seconds.length - 1];
  const index = nearestIndex(seconds);
  const reason = seconds > last ? `The recording ends at ${last.toFixed(1)} s` : "";
  return { id: "time", group: "Time", words: `Time ${seconds} s`, detail: reason ? "" : `frame ${index + 1}`, reason, run: () => go(index) };
}

/** @param {number} index */
function go(index) {
  pause();
  goTo(index);
}
