/** One stop of the Tab key per table or row of figures; the arrow keys go on from there. It follows whatever draws them. */

/**
 * A group of which one item can be reached by Tab.
 * @typedef {object} Group
 * @property {string} within Selector of the element that holds the items; it is always there.
 * @property {string} items
 * @property {"ArrowUp"|"ArrowLeft"} back
 * @property {"ArrowDown"|"ArrowRight"} on
 */
/** @type {Group[]} */
const GROUPS = [
  { within: "#page-pairs", items: "tbody tr.row", back: "ArrowUp", on: "ArrowDown" },
  { within: "#figures", items: ".figure", back: "ArrowLeft", on: "ArrowRight" },
  { within: "#page-pose", items: "tr[data-hint]", back: "ArrowUp", on: "ArrowDown" },
  { within: "#recording-topics", items: ".fact", back: "ArrowLeft", on: "ArrowRight" },
];
const CONTROLS = "button, input, select, a[href]";

export function startRoving() {
  for (const group of GROUPS) rove(group);
}

/** @param {Group} group */
function rove(group) {
  const box = /** @type {HTMLElement} */ (document.querySelector(group.within));
  const items = () => /** @type {HTMLElement[]} */ ([...box.querySelectorAll(group.items)]);
  /** The item that had the focus last, and whether it still should: a row that is drawn again is another element. */
  let [last, held] = ["", false];
  const draw = () => {
    const all = items();
    const current = all.find((item) => nameOf(item) === last) ?? all.find((item) => item.getAttribute("aria-selected") === "true") ?? all[0];
    for (const item of all) offer(item, item === current, group);
    for (const table of box.querySelectorAll("table.pairs")) nameTable(table);
    if (held && current && nameOf(current) === last && document.activeElement === document.body) current.focus({ preventScroll: true });
  };
  new MutationObserver(draw).observe(box, { childList: true, subtree: true });
  box.addEventListener("focusin", (event) => {
    const item = /** @type {HTMLElement} */ (event.target).closest(group.items);
    held = item === event.target;
    if (!(item instanceof HTMLElement)) return;
    last = nameOf(item);
    draw();
  });
  box.addEventListener("focusout", (event) => {
    if (event.relatedTarget) held = false;
  });
  box.addEventListener("keydown", (event) => move(event, items(), group));
  draw();
}

/** @param {HTMLElement} item @param {boolean} isCurrent @param {Group} group */
function offer(item, isCurrent, group) {
  item.dataset.roves = `${group.back} ${group.on} Home End Enter`;
  item.tabIndex = isCurrent ? 0 : -1;
  for (const control of /** @type {NodeListOf<HTMLElement>} */ (item.querySelectorAll(CONTROLS))) control.tabIndex = isCurrent ? 0 : -1;
}

/** A table whose rows can be chosen is a grid. @param {Element} table */
function nameTable(table) {
  table.setAttribute("role", "grid");
  table.setAttribute("aria-label", table.matches(".placements") ? "Placements" : "Pairs");
}

/** @param {KeyboardEvent} event @param {HTMLElement[]} items @param {Group} group */
function move(event, items, group) {
  const target = /** @type {HTMLElement} */ (event.target);
  const at = items.indexOf(target);
  if (at < 0 || event.ctrlKey || event.altKey || event.metaKey || event.shiftKey) return;
  const last = items.length - 1;
  const next = { [group.back]: Math.max(0, at - 1), [group.on]: Math.min(last, at + 1), Home: 0, End: last }[event.key];
  if (event.key === "Enter") target.click();
  else if (next === undefined) return;
  else items[next].focus();
  event.preventDefault();
}

/** @param {HTMLElement} item */
const nameOf = (item) => item.dataset.id ?? item.dataset.placement ?? item.dataset.key ?? item.textContent ?? "";
