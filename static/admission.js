/**
 * Comes back to a server that was restarted: its cookie is worth nothing to the new one, so the page proves that it was
 * admitted before. The secret stays in this page's memory; no request carries it.
 */

/** @type {{ticket: string, secret: string}|null} */
let kept = null;

/** Keep a ticket for later; called whenever the channel has been opened. */
export async function keepTicket() {
  const answer = await fetch("api/ticket", { cache: "no-store" }).catch(() => null);
  if (answer?.ok) kept = await answer.json();
}

/** Ask to be admitted again; does nothing while the server is down, or where the browser has no signing (not loopback). */
export async function comeBack() {
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
