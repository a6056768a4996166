/**
 * Runs in the 3D view's frame, before viser's own script. Viser draws as often as it can and shares its thread with our page;
 * without a graphics card, every drawing delays the image. The 3D view therefore draws at full rate only while the user moves
 * it, the image has priority, and nothing is drawn once nothing has arrived, moved or changed size for a while.
 */
{
  /** Minimum time between two drawings [ms]. */
  const QUIET = 125;
  const PLAYING = 1000;
  /** How long after the last input the view counts as being moved [ms]. */
  const TOUCH = 1200;
  /** How long after something arrived or moved it may still change what is drawn [ms]: images are decoded meanwhile. */
  const AWAKE = 3000;
  /** So often is drawn after that however long it takes: viser shows some of what arrives with the second drawing only. */
  const LEAST = 3;
  /** What has arrived is drawn after this time, whatever is typed meanwhile [ms]. */
  const LATEST = 500;

  try {
    new Intl.NumberFormat(navigator.language);
  } catch {
    Object.defineProperty(navigator, "language", { value: "en" }); // WebKitGTK names the locale C, which viser's plots do not survive
  }
  const frame = window.requestAnimationFrame.bind(window);
  /** @type {Map<number, FrameRequestCallback>} */
  const waiting = new Map();
  let number = 0;
  let drawn = 0;
  let touched = -TOUCH;
  let coming = false;
  let woken = performance.now();
  let owed = LEAST;
  /** Since when something waits to be drawn. */
  let since = woken;

  /** Something has arrived, moved or changed size. */
  function wake() {
    woken = performance.now();
    if (owed <= 0) since = woken;
    owed = LEAST;
    if (waiting.size) schedule();
  }

  /** When the next drawing may happen. @param {number} now */
  function next(now) {
    const page = /** @type {{playing?: boolean, every?: number, holdUntil?: number}} */ (/** @type {any} */ (window.parent).cocalibPace ?? {});
    if (now - touched < TOUCH) return now;
    return Math.max(drawn + (page.playing ? (page.every ?? PLAYING) : QUIET), Math.min(page.holdUntil ?? 0, since + LATEST));
  }

  /** Draw when it is time, with all callbacks in one frame; while nothing happens, they wait. */
  function schedule() {
    if (coming || (owed <= 0 && performance.now() - Math.max(woken, touched) > AWAKE)) return;
    coming = true;
    const now = performance.now();
    const wait = next(now) - now;
    if (wait <= 0) frame(draw);
    else setTimeout(() => frame(draw), wait);
  }

  /** @param {number} time */
  function draw(time) {
    coming = false;
    if (next(performance.now()) > performance.now()) return schedule();
    drawn = since = performance.now();
    owed -= 1;
    const callbacks = [...waiting.values()];
    waiting.clear();
    for (const callback of callbacks) callback(time);
  }

  window.requestAnimationFrame = (callback) => {
    number += 1;
    waiting.set(number, callback);
    schedule();
    return number;
  };
  window.cancelAnimationFrame = (handle) => {
    waiting.delete(handle);
  };
  for (const name of /** @type {const} */ (["Worker", "WebSocket"])) {
    /** @type {any} */
    const Original = window[name];
    /** @type {any} */ (window)[name] = class extends Original {
      /** @param {...any} given */
      constructor(...given) {
        super(...given);
        this.addEventListener("message", wake);
      }
    };
  }
  for (const type of ["pointermove", "pointerdown", "wheel", "touchstart", "keydown", "resize", "load"])
    window.addEventListener(type, wake, { capture: true, passive: true });
  /** @type {any} */ (window).cocalibWake = wake;
  for (const type of ["pointerdown", "wheel", "touchstart", "keydown"])
    window.addEventListener(type, () => (touched = performance.now()), { capture: true, passive: true });
  window.addEventListener("pointermove", (event) => event.buttons && (touched = performance.now()), { capture: true, passive: true });
}
