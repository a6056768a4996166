/** Ticks of an axis, and the shapes of marks on a plot. */

/** Round values on an axis, about so many. @param {import("./plots.js").Axis} axis @param {number} count @returns {number[]} */
export function ticks(axis, count) {
  const span = axis.high - axis.low;
  if (!(span > 0) || !Number.isFinite(span)) return [];
  const power = 10 ** Math.floor(Math.log10(span / count));
  const step = ([1, 2, 5, 10].find((factor) => span / (factor * power) <= count) ?? 10) * power;
  const first = Math.ceil(axis.low / step - 1e-9);
  const last = Math.floor(axis.high / step + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, index) => (first + index) * step);
}

/** A number as a tick: without noise of the last digits. @param {number} value */
export const words = (value) => String(Number(value.toPrecision(6))).replace("-", "−");

/** An outlier. @param {CanvasRenderingContext2D} pen @param {number} x @param {number} y @param {number} size */
export function diamond(pen, x, y, size) {
  pen.moveTo(x, y - size);
  pen.lineTo(x + size, y);
  pen.lineTo(x, y + size);
  pen.lineTo(x - size, y);
  pen.closePath();
}

/** A mark beyond the axis. @param {CanvasRenderingContext2D} pen @param {number} x @param {number} y @param {number} size @param {number} up */
export function arrow(pen, x, y, size, up) {
  pen.moveTo(x, y - up * size * 0.4);
  pen.lineTo(x + size, y + up * size);
  pen.lineTo(x - size, y + up * size);
  pen.closePath();
}
