// The secret in the address that fcu web prints: the fragment, which browsers never send to a server. Session storage
// keeps the secret for this tab, port and path; browsers would send a cookie to every other server on this machine too.

const KEY = location.pathname === "/" ? "fcu-token" : `fcu-token ${location.pathname}`; // a hub has the boards of many users

// Removes the token from the address bar and returns it, else the stored token, else "".
export function token(): string {
  const given = new URLSearchParams(location.hash.slice(1)).get("token");
  if (given !== null && /^[\w-]{1,100}$/.test(given)) {
    sessionStorage.setItem(KEY, given);
    window.history.replaceState(null, "", location.pathname + location.search);
  }
  return sessionStorage.getItem(KEY) ?? "";
}

// Pasting the printed address into an open page changes only the fragment and does not reload the page.
export function onNewToken(act: () => void): void {
  window.addEventListener("hashchange", () => {
    if (location.hash.startsWith("#token=")) act();
  });
}

// WebSocket subprotocols that the server requires; see emulator/live/requests.py.
export function protocols(secret: string): string[] {
  return ["fcu", `fcu.token.${secret}`];
}
