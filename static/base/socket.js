/**
 * The channel to the server: sends events, resends those that were not confirmed before the connection was lost, and passes
 * messages to their reader. Undo and redo are not resent, because they must not be applied twice. To a server that was restarted the
 * page proves that it was admitted before, with a secret that stays in its memory.
 */


/** @type {WebSocket|null} */
let socket = null;
let nextRequest = 1;
let delay = 250;
let opened = false;
/** @type {Map<number, {message: Record<string, any>, repeats: boolean, resolve: (text: string|null) => void}>} */
const waiting = new Map();
/** @type {{message: (message: any) => void, frame: (header: any, data: Uint8Array<ArrayBuffer>) => void, connection: (connected: boolean) => void}} */
let reader;

/** The name of this tab; its 3D view uses the same. */
export const tab = Array.from(crypto.getRandomValues(new Uint8Array(9)), (byte) => byte.toString(36)).join("");

/** Open the channel and keep it open. @param {typeof reader} given */
export function connect(given) {
  reader = given;
  open();
}

function open() {
  const address = new URL(`ws/${tab}`, location.href);
  address.protocol = address.protocol.replace("http", "ws");
  socket = new WebSocket(address);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => {
    delay = 250;
    opened = true;
    socket?.send(JSON.stringify({ type: "hello" }));
    for (const [request, { message }] of waiting) socket?.send(JSON.stringify({ ...message, request }));
    reader.connection(true);
    keepTicket();
  };
  socket.onmessage = (event) => (typeof event.data === "string" ? receive(JSON.parse(event.data)) : unpack(event.data));
  socket.onclose = lost;
}

function lost() {
  socket = null;
  for (const [request, { repeats, resolve }] of waiting) {
    if (repeats) continue;
    waiting.delete(request);
    resolve("The connection was lost before the server confirmed the change.");
  }
  reader.connection(false);
  setTimeout(() => comeBack().finally(open), delay);
  delay = Math.min(opened ? 1000 : 4000, delay * 2);
}

/** @param {any} message */
function receive(message) {
  const request = waiting.get(message.request);
  if (!request || (message.type !== "done" && message.type !== "error")) return reader.message(message);
  waiting.delete(message.request);
  request.resolve(message.type === "done" ? null : message.message);
}

/** @param {ArrayBuffer} buffer */
function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  reader.frame(header, new Uint8Array(buffer, 4 + length));
}

/**
 * Send an event, and keep it until the server confirms it.
 * @param {Record<string, any>} message
 * @returns {Promise<string|null>} null when confirmed, else why it was refused
 */
export function send(message) {
  const request = nextRequest++;
  const repeats = message.type !== "undo" && message.type !== "redo";
  return new Promise((resolve) => {
    waiting.set(request, { message, repeats, resolve });
    if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ ...message, request }));
    else if (!repeats) lostNow(request);
  });
}

/** @param {number} request */
function lostNow(request) {
  waiting.get(request)?.resolve("Not connected.");
  waiting.delete(request);
}

/** Send something that is useless later, such as a cursor or a request for a frame. @param {Record<string, any>} message @returns {boolean} whether it was sent */
export function tell(message) {
  if (socket?.readyState !== WebSocket.OPEN) return false;
  socket.send(JSON.stringify(message));
  return true;
}

/** A number for a request that does not go through `send`. */
export const requestNumber = () => nextRequest++;

/** Number of events that the server has not confirmed. */
export const unconfirmed = () => waiting.size;

/** @type {{ticket: string, secret: string}|null} */
let kept = null;

/** Keep a ticket for later; called whenever the channel has been opened. */
async function keepTicket() {
  const answer = await fetch("api/ticket", { cache: "no-store" }).catch(() => null);
  if (answer?.ok) kept = await answer.json();
}

/** Ask to be admitted again; does nothing while the server is down, or where the browser has no signing (not loopback). */
async function comeBack() {
  if (!kept || !crypto.subtle) return;
  const asked = await fetch("api/challenge", { cache: "no-store" }).catch(() => null);
  if (!asked?.ok) return;
  const { challenge } = await asked.json();
  const signed = await proof(kept.secret, `${challenge}\n${location.origin}`);
  const query = new URLSearchParams({ ticket: kept.ticket, challenge, proof: signed });
  await fetch(`api/resume?${query}`, { cache: "no-store" }).catch(() => null);
}

/** @param {string} secret hexadecimal digits @param {string} text */
async function proof(secret, text) {
  const bytes = Uint8Array.from(secret.match(/../g) ?? [], (digits) => parseInt(digits, 16));
  const key = await crypto.subtle.importKey("raw", bytes, { name: "HMAC", hash: "SHA-256" }, false, ["sign"]);
  const signature = await crypto.subtle.sign("HMAC", key, new TextEncoder().encode(text));
  return Array.from(new Uint8Array(signature), (byte) => byte.toString(16).padStart(2, "0")).join("");
}
