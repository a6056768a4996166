// Runs in the page: measures from the pointer's release to the painted image. Evaluated by benchmarks/speed/paging.py.
() => {
  const { state, clicks, clickIn, goTo, toCss } = window.__cocalib;
  const painted = () => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  const until = async (condition, limitMs = 20000) => {
    const start = performance.now();
    while (!condition()) {
      if (performance.now() - start > limitMs) throw new Error("timed out waiting for " + condition);
      await new Promise((done) => requestAnimationFrame(done));
    }
  };
  const solved = () => state.view && !state.view.solving && state.view.solved_revision === state.view.revision;
  const canvas = () => document.getElementById("marks");
  const press = (type, x, y) =>
    canvas().dispatchEvent(
      new PointerEvent(type, { clientX: x, clientY: y, button: 0, buttons: type === "pointerup" ? 0 : 1, pointerId: 1, isPrimary: true, bubbles: true, cancelable: true }),
    );
  const settled = async () => {
    await until(() => state.shown && state.connected);
    if (state.view && state.view.clicks.length) await until(solved);
    await new Promise((done) => setTimeout(done, 1500));
  };
  window.__measures = {
    settled,
    /** Drag the mark of one click by a few pixels, as a user would to correct it. Earlier versions have no preview: there it is the answer. */
    async click(number) {
      const click = state.view.clicks[number % state.view.clicks.length];
      goTo(click.frame);
      await until(() => state.shown.index === click.frame && solved());
      await new Promise((done) => setTimeout(done, 100));
      const box = canvas().getBoundingClientRect();
      const [x, y] = toCss(click.u_px, click.v_px);
      const by = number % 2 ? 6 : -6;
      const revision = state.view.revision;
      press("pointerdown", box.left + x, box.top + y);
      press("pointermove", box.left + x + by, box.top + y);
      const start = performance.now();
      press("pointerup", box.left + x + by, box.top + y);
      await until(() => Math.abs(clickIn(click.frame).u_px - click.u_px) > 0.01);
      await painted();
      const mark = performance.now() - start;
      const since = async (condition) => {
        await until(() => state.view.revision > revision && condition());
        await painted();
        return performance.now() - start;
      };
      const [preview, answer] = await Promise.all([since(() => state.view.checking || solved()), since(solved)]);
      return { mark, preview, answer };
    },
    /** Open the page Check: until its grid is drawn, and until the cut-outs in sight are. */
    async sheet() {
      const start = performance.now();
      const cells = document.getElementsByClassName("crop");
      const images = () => [...cells].slice(0, 8).map((cell) => cell.querySelector("img"));
      const tab = document.getElementById("tab-check");
      for (const type of ["pointerdown", "pointerup", "click"]) tab.dispatchEvent(new PointerEvent(type, { pointerId: 1, isPrimary: true, bubbles: true }));
      await until(() => cells.length === state.view.clicks.length);
      await painted();
      const grid = performance.now() - start;
      await until(() => images().every((image) => image && image.complete && image.naturalWidth));
      await painted();
      return { grid, cutOuts: performance.now() - start };
    },
    /** Step one frame forward; from the last one to the first. */
    async step() {
      const target = (state.cursor + 1) % state.seconds.length;
      const start = performance.now();
      goTo(target);
      await until(() => state.shown.index === target);
      await painted();
      const taken = performance.now() - start;
      await new Promise((done) => setTimeout(done, 50));
      return taken;
    },
    /** Play for some seconds; at the end, continue from the start. */
    async play(seconds) {
      goTo(0);
      await until(() => state.shown.index === 0);
      const start = performance.now();
      let [shown, last, lastAt, longest] = [0, 0, start, 0];
      document.getElementById("play").click();
      while (performance.now() - start < seconds * 1000) {
        await new Promise((done) => requestAnimationFrame(done));
        if (!state.playing) document.getElementById("play").click();
        if (state.shown.index === last) continue;
        const now = performance.now();
        longest = Math.max(longest, now - lastAt);
        [last, lastAt, shown] = [state.shown.index, now, shown + 1];
      }
      const taken = (performance.now() - start) / 1000;
      if (state.playing) document.getElementById("play").click();
      return { shown, seconds: taken, longest_gap_ms: longest };
    },
    /** Request many frames at once, as a held key does, and check whether the last one is shown. */
    async push(count) {
      const first = Math.max(0, Math.min(state.cursor, state.seconds.length - count - 1));
      const seen = new Set();
      const start = performance.now();
      for (let k = 1; k <= count; k++) goTo(first + k);
      const until_ms = start + 10000;
      while (state.shown.index !== first + count && performance.now() < until_ms) {
        seen.add(state.shown.index);
        await new Promise((done) => requestAnimationFrame(done));
      }
      return { settled: state.shown.index === first + count, settled_ms: performance.now() - start, shown: seen.size };
    },
  };
}
