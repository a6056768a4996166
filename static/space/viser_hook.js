/**
 * All use of viser's private browser API: where its camera is, and when it has drawn. viser sets `__viserMutable` for its own tests;
 * a version without it leaves the 3D view without labels and picking. tests/browser/test_space.py says in words what changed.
 */

/** How long the 3D view may take to start [ms]. */
const PATIENCE = 60000;
const LOOK_EVERY = 100;
/** A node at the origin of the radar frame, and one whose position is the frame and the number that are shown (app/cocalib/web/view3d/scene.py). */
const [RADAR, SHOWN] = ["/radar", "/shown"];

/** @type {any} */
let viser = null;
/** @type {any} */
let hookedScene = null;
/** Lets it draw again while nothing happens (pace.js). */
let wakeUp = () => {};

/** A frame whose page could not be loaded shows a page of the browser's, which nothing can be read from. @param {any} owner */
function partsOf(owner) {
  try {
    return owner?.__viserMutable;
  } catch {
    return undefined;
  }
}

/** What the 3D view in a window lacks, in words; empty if everything is there. @param {any} owner @returns {string[]} */
export function missingParts(owner) {
  const found = partsOf(owner);
  if (!found) return ["window.__viserMutable"];
  const elements = (/** @type {any} */ matrix) => matrix?.elements?.length === 16;
  const parts = {
    "__viserMutable.scene.onAfterRender": typeof found.scene?.onAfterRender === "function",
    "__viserMutable.camera.projectionMatrix": elements(found.camera?.projectionMatrix),
    "__viserMutable.camera.matrixWorldInverse": elements(found.camera?.matrixWorldInverse),
    [`__viserMutable.nodeRefFromName["${RADAR}"].matrixWorld`]: elements(found.nodeRefFromName?.[RADAR]?.matrixWorld),
    [`__viserMutable.nodeRefFromName["${SHOWN}"].position`]: typeof found.nodeRefFromName?.[SHOWN]?.position?.x === "number",
    "__viserMutable.requestRender": typeof found.requestRender === "function",
  };
  return Object.keys(parts).filter((name) => !parts[name]);
}

/**
 * Call a function after every drawing of the 3D view in a window.
 * @param {Window} owner @param {() => void} drawn
 * @returns {Promise<string[]>} what is missing; empty if the hook is in place
 */
export async function hookInto(owner, drawn) {
  viser = null;
  const end = performance.now() + PATIENCE;
  let missing = missingParts(owner);
  while (missing.length && performance.now() < end && !owner.closed) {
    await new Promise((done) => setTimeout(done, LOOK_EVERY));
    missing = missingParts(owner);
  }
  if (missing.length) return missing;
  viser = /** @type {any} */ (owner).__viserMutable;
  wakeUp = /** @type {any} */ (owner).cocalibWake ?? wakeUp;
  hook(drawn);
  return [];
}

/** @param {() => void} drawn */
function hook(drawn) {
  const scene = viser.scene;
  if (hookedScene === scene) return;
  hookedScene = scene;
  const before = scene.onAfterRender;
  scene.onAfterRender = (/** @type {any[]} */ ...given) => {
    before.apply(scene, given);
    drawn();
  };
}

/** Draw the 3D view again, for example after its size has changed. */
export function drawAgain() {
  wakeUp();
  viser?.requestRender();
}

/** The frame that the 3D view has drawn, and the number of that drawing; null before the first. @returns {{index: number, number: number}|null} */
export function shownThere() {
  const at = viser?.nodeRefFromName[SHOWN]?.position;
  return at && at.y > 0 ? { index: Math.round(at.x), number: Math.round(at.y) } : null;
}

/**
 * How the 3D view projects at this moment: from metres in the radar frame to CSS px of a box; null for points behind the viewer.
 * @param {number} width @param {number} height of the box [CSS px]
 * @returns {((point: readonly number[]) => [number, number]|null)|null}
 */
export function projection(width, height) {
  const radar = viser?.nodeRefFromName[RADAR];
  if (!radar) return null;
  const { camera } = viser;
  const m = times(camera.projectionMatrix.elements, times(camera.matrixWorldInverse.elements, radar.matrixWorld.elements));
  return ([x, y, z]) => {
    const w = m[3] * x + m[7] * y + m[11] * z + m[15];
    if (w <= 1e-6) return null;
    const [u, v] = [(m[0] * x + m[4] * y + m[8] * z + m[12]) / w, (m[1] * x + m[5] * y + m[9] * z + m[13]) / w];
    return [((u + 1) / 2) * width, ((1 - v) / 2) * height];
  };
}

/** Product of two matrices, column by column as in three.js. @param {number[]} a @param {number[]} b */
function times(a, b) {
  const product = new Array(16);
  for (let row = 0; row < 4; row += 1)
    for (let column = 0; column < 4; column += 1)
      product[4 * column + row] = a[row] * b[4 * column] + a[row + 4] * b[4 * column + 1] + a[row + 8] * b[4 * column + 2] + a[row + 12] * b[4 * column + 3];
  return product;
}
