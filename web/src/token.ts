// The secret of the address that fcu web prints: its fragment, which no browser sends to a server. Session storage
// keeps it for this tab and this port; a cookie would go to each other server of this machine as well.

const KEY = "fcu-token";

// Takes the token out of the address bar, and returns it, or the one that was kept; "" if there is none.
export function token(): string {
  const given = new URLSearchParams(location.hash.slice(1)).get("token");
  if (given !== null && /^[\w-]{1,100}$/.test(given)) {
    sessionStorage.setItem(KEY, given);
    window.history.replaceState(null, "", location.pathname + location.search);
  }
  return sessionStorage.getItem(KEY) ?? "";
}

// The printed address pasted into an open page changes the fragment only, and loads nothing.
export function onNewToken(act: () => void): void {
  window.addEventListener("hashchange", () => {
    if (location.hash.startsWith("#token=")) act();
  });
}

// What the server wants to be offered by who opens a socket; see emulator/live/requests.py.
export function protocols(secret: string): string[] {
  return ["fcu", `fcu.token.${secret}`];
}
