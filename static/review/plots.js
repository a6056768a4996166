/**
 * Small plots on a canvas: dots or bars with axes, ticks and units. Every mark stands for one or more pairs; pointing at it, or moving
 * to it with the arrow keys, tells the owner, which highlights the same pairs in every plot.
 */

import { growth, smallFont, themeColour } from "../base/colours.js";
import { hideTip, make, showTip } from "../base/notices.js";

/** @typedef {"agreeing"|"outlier"|"excluded"|"untouched"} Kind */
/** A mark; beyond the axis it is drawn at the edge. @typedef {{ids: string[], x: number, y: number, kind: Kind, text: () => string}} Mark */
/** @typedef {{label: string, low: number, high: number, words?: (value: number) => string}} Axis */
/** @typedef {{marks: Mark[], x: Axis, y: Axis, bar: number, limit: number|null, empty: string}} Content */
/** What the owner wants to know. @typedef {{hover: (mark: Mark|null) => void, go: (mark: Mark) => void, brush: (ids: string[]) => void, line?: (value: number) => void}} Listener */
/** What is highlighted in all plots. @typedef {{hovered: Set<string>, brushed: Set<string>, selected: string|null}} Highlight */

const COLOURS = ["accent", "accent-soft", "attention", "ink", "line", "line-strong", "muted"];
const EDGE = { left: 38, right: 8, top: 18, bottom: 28 };
/** A mark this close to the pointer is meant [px of the plot]. */
const REACH = 12;
/** A press that moves farther than this selects a region [CSS px]. */
const THRESHOLD = 4;

/** Where an event is on a plot [px of the plot]. @param {MouseEvent} event @returns {[number, number]} */
const at = (event) => [event.offsetX / growth(), event.offsetY / growth()];

/** One plot. */
export class Plot {
  /** @param {string} key @param {string} title @param {Listener} listener */
  constructor(key, title, listener) {
    this.title = title;
    this.listener = listener;
    /** @type {Content} */ this.content = { marks: [], x: { label: "", low: 0, high: 1 }, y: { label: "", low: 0, high: 1 }, bar: 0, limit: null, empty: "" };
    /** @type {Highlight} */ this.highlight = { hovered: new Set(), brushed: new Set(), selected: null };
    this.at = -1;
    /** Colours of the theme, read once per drawing. @type {Record<string, string>} */ this.colour = {};
    /** @type {{x: number, y: number, toX: number, toY: number}|null} */ this.press = null;
    this.canvas = make("canvas", "plot", []);
    this.canvas.dataset.plot = key;
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "application");
    this.pen = /** @type {CanvasRenderingContext2D} */ (this.canvas.getContext("2d"));
    this.canvas.addEventListener("pointermove", (event) => this.moved(event));
    this.canvas.addEventListener("pointerdown", (event) => this.pressed(event));
    this.canvas.addEventListener("pointerup", (event) => this.released(event));
    this.canvas.addEventListener("pointerleave", () => this.leave());
    this.canvas.addEventListener("keydown", (event) => this.typed(event));
    this.canvas.addEventListener("blur", () => this.listener.hover(null));
    /** Of the plot, which its canvas's box gives: in CSS px, or in larger ones on a 4K monitor. @type {[number, number]} */ this.size = [0, 0];
    new ResizeObserver(([{ contentRect }]) => {
      this.size = [contentRect.width / growth(), contentRect.height / growth()];
      this.draw();
    }).observe(this.canvas);
  }

  /** @param {Content} content @param {Highlight} highlight */
  show(content, highlight) {
    this.content = content;
    this.highlight = highlight;
    const count = content.marks.reduce((sum, mark) => sum + mark.ids.length, 0);
    this.canvas.setAttribute("aria-label", `${this.title}: ${count} clicks. Arrow keys move from mark to mark, Enter goes to its frame.`);
    if (this.at >= content.marks.length) this.at = -1;
    this.draw();
  }

  /** Data to px of the plot, kept on the plot. @param {number} x @param {number} y @returns {[number, number]} */
  place(x, y) {
    const [width, height] = this.size;
    const { x: across, y: up } = this.content;
    const share = (/** @type {number} */ value, /** @type {Axis} */ axis) => Math.min(1, Math.max(0, (value - axis.low) / (axis.high - axis.low)));
    return [EDGE.left + share(x, across) * (width - EDGE.left - EDGE.right), height - EDGE.bottom - share(y, up) * (height - EDGE.top - EDGE.bottom)];
  }

  /** Marks from left to right, as the arrow keys go. */
  get ordered() {
    return [...this.content.marks].sort((a, b) => a.x - b.x || a.y - b.y);
  }

  draw() {
    const [width, height] = this.size;
    if (!width || !height) return;
    this.colour = Object.fromEntries(COLOURS.map((name) => [name, themeColour(name)]));
    const ratio = (window.devicePixelRatio || 1) * growth();
    const [wide, high] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (this.canvas.width !== wide || this.canvas.height !== high) [this.canvas.width, this.canvas.height] = [wide, high];
    this.pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.pen.clearRect(0, 0, width, height);
    this.drawAxes(width, height);
    const marks = [...this.content.marks].sort((a, b) => this.loudness(a) - this.loudness(b)); // what stands out is on top
    for (const mark of marks) this.content.bar ? this.drawBar(mark) : this.drawDot(mark);
    this.drawLimit();
    this.drawPress();
    if (!this.content.marks.length) this.drawEmpty(width, height);
  }

  /** How much a mark stands out: 2 under the pointer or selected, 1 brushed. @param {Mark} mark */
  loudness(mark) {
    const { hovered, brushed, selected } = this.highlight;
    if (mark.ids.some((id) => hovered.has(id) || id === selected)) return 2;
    return mark.ids.some((id) => brushed.has(id)) ? 1 : 0;
  }

  /** @param {number} width @param {number} height */
  drawAxes(width, height) {
    const { pen, content } = this;
    const [floor, right] = [height - EDGE.bottom, width - EDGE.right];
    pen.font = smallFont(1 / growth());
    pen.lineWidth = 1;
    pen.textBaseline = "alphabetic";
    for (const [axis, upright] of /** @type {[Axis, boolean][]} */ ([[content.x, false], [content.y, true]])) {
      const most = Math.max(2, Math.floor((upright ? floor - EDGE.top : right - EDGE.left) / (upright ? 20 : 32)));
      for (const value of ticks(axis, content.bar && !upright ? Math.min(most, axis.high) : most)) {
        const [x, y] = this.place(upright ? content.x.low : value, upright ? value : content.y.low);
        pen.strokeStyle = this.colour.line;
        pen.beginPath();
        pen.moveTo(Math.round(x) + 0.5, upright ? Math.round(y) + 0.5 : EDGE.top);
        pen.lineTo(upright ? right : Math.round(x) + 0.5, upright ? Math.round(y) + 0.5 : floor);
        pen.stroke();
        pen.fillStyle = this.colour.muted;
        pen.textAlign = upright ? "right" : "center";
        pen.fillText((axis.words ?? words)(value), upright ? EDGE.left - 5 : Math.min(x, right - 6), upright ? y + 3.5 : floor + 12);
      }
    }
    pen.strokeStyle = this.colour["line-strong"];
    pen.beginPath();
    pen.moveTo(EDGE.left + 0.5, EDGE.top);
    pen.lineTo(EDGE.left + 0.5, floor + 0.5);
    pen.lineTo(right, floor + 0.5);
    pen.stroke();
    pen.fillStyle = this.colour.muted;
    pen.textAlign = "right";
    pen.fillText(content.x.label, right, height - 4);
    pen.textAlign = "left";
    pen.fillText(content.y.label, 4, 11);
  }

  /** @param {Mark} mark */
  drawDot(mark) {
    const { pen, content } = this;
    const [x, y] = this.place(mark.x, mark.y);
    const loud = this.loudness(mark);
    const colour = this.colour[mark.kind === "agreeing" ? "accent" : mark.kind === "outlier" ? "attention" : "muted"];
    const size = (content.marks.length > 120 ? 2.2 : 3.2) * (loud === 2 ? 1.4 : 1);
    pen.globalAlpha = loud || !this.highlight.brushed.size ? 0.9 : 0.22;
    pen.fillStyle = pen.strokeStyle = colour;
    pen.lineWidth = 1.4;
    pen.beginPath();
    if (mark.y > content.y.high || mark.y < content.y.low) arrow(pen, x, y, size * 1.5, mark.y > content.y.high ? 1 : -1);
    else if (mark.kind === "outlier") diamond(pen, x, y, size * 1.5);
    else pen.arc(x, y, size, 0, 2 * Math.PI);
    mark.kind === "agreeing" || mark.kind === "outlier" ? pen.fill() : pen.stroke();
    pen.globalAlpha = 1;
    if (loud !== 2) return;
    pen.strokeStyle = this.colour.ink;
    pen.lineWidth = 1.2;
    pen.beginPath();
    pen.arc(x, y, size + 3.5, 0, 2 * Math.PI);
    pen.stroke();
  }

  /** @param {Mark} mark */
  drawBar(mark) {
    const { pen, content } = this;
    if (!mark.ids.length) return;
    const [left, top] = this.place(mark.x - content.bar / 2, mark.y);
    const [right, floor] = this.place(mark.x + content.bar / 2, 0);
    const loud = this.loudness(mark);
    pen.fillStyle = this.colour[mark.kind === "outlier" ? "attention" : "accent"];
    pen.globalAlpha = loud === 2 ? 1 : loud ? 0.8 : this.highlight.brushed.size ? 0.22 : 0.6;
    pen.fillRect(left + 0.5, top, Math.max(1, right - left - 1), floor - top);
    pen.globalAlpha = 1;
  }

  /** The limit above which a residual should be checked. */
  drawLimit() {
    const { pen, content } = this;
    if (content.limit === null || content.limit > content.y.high) return;
    pen.setLineDash([4, 3]);
    pen.lineWidth = 1;
    pen.strokeStyle = this.colour.attention;
    for (const limit of content.y.low < 0 ? [content.limit, -content.limit] : [content.limit]) {
      pen.beginPath();
      pen.moveTo(...this.place(content.x.low, limit));
      pen.lineTo(...this.place(content.x.high, limit));
      pen.stroke();
    }
    pen.setLineDash([]);
  }

  /** The region that is being selected. */
  drawPress() {
    if (!this.press || this.listener.line) return;
    const { x, y, toX, toY } = this.press;
    this.pen.strokeStyle = this.colour.accent;
    this.pen.fillStyle = this.colour["accent-soft"];
    this.pen.fillRect(x, y, toX - x, toY - y);
    this.pen.strokeRect(x, y, toX - x, toY - y);
  }

  /** @param {number} width @param {number} height */
  drawEmpty(width, height) {
    this.pen.fillStyle = this.colour.muted;
    this.pen.textAlign = "center";
    this.pen.fillText(this.content.empty, width / 2 + EDGE.left / 2, height / 2);
  }

  /** The mark under the pointer. @param {MouseEvent} event @returns {Mark|null} */
  near(event) {
    const { marks, bar } = this.content;
    const [across, along] = at(event);
    if (bar) {
      return marks.find((mark) => mark.ids.length && Math.abs(this.place(mark.x, 0)[0] - across) <= (this.place(mark.x + bar, 0)[0] - this.place(mark.x, 0)[0]) / 2) ?? null;
    }
    /** @type {Mark|null} */ let best = null;
    let least = REACH;
    for (const mark of marks) {
      const [x, y] = this.place(mark.x, mark.y);
      const far = Math.hypot(x - across, y - along);
      if (far < least) [best, least] = [mark, far];
    }
    return best;
  }

  /** @param {PointerEvent} event */
  moved(event) {
    if (!this.press) {
      const mark = this.near(event);
      if (mark) showTip(mark.text(), event.clientX, event.clientY + 10);
      else hideTip();
      return this.listener.hover(mark);
    }
    [this.press.toX, this.press.toY] = at(event);
    if (this.listener.line) return this.listener.line(this.valueAt(this.press.toY));
    this.draw();
  }

  /** The value at a height. @param {number} y px of the plot */
  valueAt(y) {
    const { low, high } = this.content.y;
    const floor = this.size[1] - EDGE.bottom;
    return Math.max(low, Math.min(high, low + ((floor - y) / (floor - EDGE.top)) * (high - low)));
  }

  leave() {
    hideTip();
    this.listener.hover(null);
  }

  /** @param {PointerEvent} event */
  pressed(event) {
    if (event.button !== 0) return;
    this.canvas.setPointerCapture(event.pointerId);
    const [x, y] = at(event);
    this.press = { x, y, toX: x, toY: y };
  }

  /** @param {PointerEvent} event */
  released(event) {
    const done = this.press;
    this.press = null;
    if (!done) return;
    const [x, y] = at(event);
    const [left, right] = [Math.min(done.x, x), Math.max(done.x, x)];
    const [top, bottom] = [Math.min(done.y, y), Math.max(done.y, y)];
    if (Math.max(right - left, bottom - top) > THRESHOLD) return this.listener.line ? undefined : this.listener.brush(this.inside(left, right, top, bottom));
    const mark = this.near(event);
    if (mark) this.listener.go(mark);
    else this.listener.brush([]);
  }

  /** @param {number} left @param {number} right @param {number} top @param {number} bottom CSS px @returns {string[]} */
  inside(left, right, top, bottom) {
    const met = this.content.marks.filter((mark) => {
      const [x, y] = this.place(mark.x, mark.y);
      return left <= x && x <= right && (this.content.bar > 0 || (top <= y && y <= bottom));
    });
    return met.flatMap((mark) => mark.ids);
  }

  /** @param {KeyboardEvent} event */
  typed(event) {
    const marks = this.ordered.filter((mark) => mark.ids.length);
    const step = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
    const { limit, y } = this.content;
    if (this.listener.line && limit !== null && /^Arrow(Up|Down)$/.test(event.key)) {
      event.preventDefault();
      this.content.limit = Math.max(0, Math.min(y.high, limit + 0.02 * y.high * (step ?? 0)));
      return this.listener.line(this.content.limit);
    }
    if (step && marks.length) {
      this.at = this.at < 0 ? (step > 0 ? 0 : marks.length - 1) : (this.at + step + marks.length) % marks.length;
      this.listener.hover(marks[this.at]);
    } else if ((event.key === "Enter" || event.key === " ") && marks[this.at]) this.listener.go(marks[this.at]);
    else if (event.key === "Escape") this.listener.brush([]);
    else return;
    event.preventDefault();
  }
}

/** Round values on an axis, about so many. @param {Axis} axis @param {number} count @returns {number[]} */
function ticks(axis, count) {
  const span = axis.high - axis.low;
  if (!(span > 0) || !Number.isFinite(span)) return [];
  const power = 10 ** Math.floor(Math.log10(span / count));
  const step = ([1, 2, 5, 10].find((factor) => span / (factor * power) <= count) ?? 10) * power;
  const first = Math.ceil(axis.low / step - 1e-9);
  const last = Math.floor(axis.high / step + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, index) => (first + index) * step);
}

/** A number as a tick: without noise of the last digits. @param {number} value */
const words = (value) => String(Number(value.toPrecision(6))).replace("-", "−");

/** An outlier. @param {CanvasRenderingContext2D} pen @param {number} x @param {number} y @param {number} size */
function diamond(pen, x, y, size) {
  pen.moveTo(x, y - size);
  pen.lineTo(x + size, y);
  pen.lineTo(x, y + size);
  pen.lineTo(x - size, y);
  pen.closePath();
}

/** A mark beyond the axis. @param {CanvasRenderingContext2D} pen @param {number} x @param {number} y @param {number} size @param {number} up */
function arrow(pen, x, y, size, up) {
  pen.moveTo(x, y - up * size * 0.4);
  pen.lineTo(x + size, y + up * size);
  pen.lineTo(x - size, y + up * size);
  pen.closePath();
}
