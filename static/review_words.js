/** The figures of a pair in the review, as text. */

/** Limits of an axis, a little beyond its values. @param {number[]} values */
export function spread(values) {
  if (!values.length) return { low: 0, high: 1 };
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const margin = 0.05 * (high - low) || 0.5;
  return { low: low - margin, high: high + margin };
}

/** A pair in one line. @param {import("./review.js").Row} row */
export function told(row) {
  const { click } = row;
  const side = (/** @type {number|null} */ angle, /** @type {string} */ plus, /** @type {string} */ minus) => `${Math.abs(angle ?? 0).toFixed(1)}° ${(angle ?? 0) >= 0 ? plus : minus}`;
  const more = [row.heldOut === null ? "" : `held out ${digits(row.heldOut)} px`, row.influence === null ? "" : `influence ${digits(row.influence)} σ`];
  return [`${click.id}: ${digits(row.length)} px`, `${click.range_m?.toFixed(1)} m, ${side(click.azimuth_deg, "left", "right")}`, ...more.filter(Boolean)].join(" · ");
}

/** Three significant digits. @param {number} value */
export const digits = (value) => (Math.abs(value) < 0.995 ? String(Number(value.toFixed(2))) : String(Number(value.toPrecision(3))));

/** @param {number} number */
export const count = (number) => `${number} pair${number === 1 ? "" : "s"}`;
