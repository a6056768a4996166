/** Applies what the server sends of a View: the whole, or what differs from the one before. */

/** @typedef {import("./messages.js").View} View */
/** @typedef {import("./messages.js").ClickRow} Click */

/** Return the View after a change; a row that does not change stays the same object. @param {View} view @param {import("./messages.js").ViewChange} change @returns {View} */
function changed(view, change) {
  const clicks = change.clicks ? changedRows(view.clicks, change.clicks) : view.clicks;
  return /** @type {View} */ ({ ...view, ...change.fields, clicks });
}

/** @param {Click[]} rows @param {import("./messages.js").ClickChange} change @returns {Click[]} */
function changedRows(rows, change) {
  const next = change.removed.length || change.added.length ? moved(rows, change) : [...rows];
  const copied = new Set(change.added);
  for (const { rows: given, fields } of change.values) {
    const places = given ?? next.keys();
    let column = 0;
    for (const place of places) {
      if (!copied.has(place)) next[place] = { ...next[place] };
      copied.add(place);
      for (const name in fields) Object.assign(next[place], { [name]: fields[name][column] });
      column += 1;
    }
  }
  return next;
}

/** Remove rows, and make room for those that are added. @param {Click[]} rows @param {import("./messages.js").ClickChange} change @returns {Click[]} */
function moved(rows, change) {
  const gone = new Set(change.removed);
  const kept = rows.filter((_, place) => !gone.has(place));
  const added = new Set(change.added);
  let from = 0;
  return Array.from({ length: kept.length + added.size }, (_, place) => (added.has(place) ? /** @type {Click} */ ({}) : kept[from++]));
}

/** Follows the View that the server sends, and notices a change that is missing. */
export class Follower {
  /** @type {View|null} */ view = null;
  /** Changes since the last whole View. */ changes = 0;

  /** Take a whole View. @param {View} view */
  take(view) {
    this.view = view;
    this.changes = 0;
  }

  /** Take a change. @param {import("./messages.js").ViewChange} change @returns {boolean} false if one before it is missing: a whole View is needed */
  follow(change) {
    if (!this.view || change.number !== this.changes + 1) return false;
    this.view = changed(this.view, change);
    this.changes += 1;
    return true;
  }
}
