// The messages of emulator/live/messages.py, and what carries them. The page knows a session only by these.

import { onNewToken, protocols, token } from "./token";

export interface Field { name: string; msb: number; lsb: number; doc: string }
export interface Register {
  name: string; address: number; size: number; reset: number; access: string; doc: string; modelled: boolean;
  fields: Field[];
}
export interface Part { name: string; doc: string; place: string; registers: Register[] }
export interface Output { id: string; part: string; quantity: string; doc: string; unit: string; axes: number }

export interface Hello {
  type: "hello"; board: string; version: string; leds: string[]; firmware: Record<string, string>;
  scenarios: Record<string, string>; parts: string[]; outputs: Output[]; ways: string[]; gestures: Gesture[]; exercises: Exercise[];
}
export interface Gesture { word: string; label: string; doc: string; entries: Entry[] }
export interface Exercise { id: string; title: string; question: string; next: string }
export interface Status {
  type: "status"; run: number; firmware: string; file: string; sources: Record<string, string>; wiring: string; scenario: string; question: string;
  duration_s: number; state: "running" | "paused" | "failed" | "halted"; speed: number | null; problem: string; notes: string[];
  variables: string[]; peripherals: string[]; recording: string;
}
export type Place = [north: number, west: number, up: number];
export interface Truth {
  rotation: number[]; roll_deg: number; pitch_deg: number; yaw_deg: number; altitude_m: number; magnet_m: Place | null; rate_dps: number[];
  acc_mg: number[]; mag_mgauss: number[]; pressure_hpa: number; temperature_degc: number; humidity_percent: number;
}
export interface State {
  type: "state"; run: number; t_s: number; pace: number; leds: Record<string, boolean>; truth: Truth;
  samples: Record<string, number[]>; variables: Record<string, number>; load: Record<string, number>; done: number;
}
export interface Text { type: "text"; run: number; position: number; text: string }
export interface Printed { type: "printed"; t_s: number; values: Record<string, number>; truth: Record<string, number> }
export type PlottedTruth = Omit<Truth, "rotation" | "magnet_m">;
export interface Plotted { t_s: number; truth: PlottedTruth; samples: Record<string, number[]>; variables: Record<string, number> }
export interface Past { type: "past"; run: number; states: Plotted[]; prints: { t_s: number; values: Record<string, number> }[] }
export interface Unknown { type: "unknown"; variables: string[] }
export interface Check { title: string; outcome: "passed" | "partial" | "failed" | "unjudged"; expected: string; seen: string; source: string; hint: string }
export interface Checked {
  type: "checked"; exercise: string; state: "checking" | "done" | "begun" | "not yet" | "unjudged" | "error"; points: number;
  max_points: number; checks: Check[]; causes: { summary: string; details: string[]; fatal: boolean }[]; problem: string; outdated: boolean;
}
export interface Declared { type: "declared"; part: Part }
export interface Registers { type: "registers"; part: string; values: Record<string, string>; note: string }
export interface Pin { name: string; use: string; mode: string; level: 0 | 1 | null; pull: 0 | 1 | null }
export interface Pins { type: "pins"; pins: Pin[] }
export interface Transfer {
  t_s: number; bus: string; device: string; register: string; way: "read" | "write"; bytes: string; count: number;
  meaning: string; result: string;
}
export interface Bus { type: "bus"; transfers: Transfer[] }
export interface Verdict { key: string; kind: string; says: string; state: "open" | "met" | "failed"; found: string }
export interface Verdicts { type: "verdicts"; verdicts: Verdict[]; over: boolean }
export interface Finding { kind: string; summary: string; details: string[]; fatal: boolean }
export interface Findings { type: "findings"; findings: Finding[] }
export interface Recorded { type: "recorded"; text: string }
export interface Notice { type: "notice"; kind: "error" | "info"; text: string }

export type Event =
  | Hello | Status | State | Text | Printed | Past | Unknown | Checked | Declared | Registers | Pins | Bus | Verdicts | Findings | Recorded | Notice;

export type Entry = { do: string } & Record<string, unknown>;
export type Command =
  | { type: "do"; entry: Entry; id?: number }
  | { type: "run" } | { type: "pause" } | { type: "reset" } | { type: "record" }
  | { type: "step"; of: "tick" | "line" | "second" }
  | { type: "speed"; factor: number | null }
  | { type: "firmware"; name: string }
  | { type: "upload"; name: string; data: string }
  | { type: "play"; scenario: string | null }
  | { type: "check"; exercise: string }
  | { type: "watch"; variables: string[]; registers: string | null; bus: boolean; pins: boolean };

export interface Session {
  send(command: Command): void;
  onEvent: (event: Event) => void;
  onConnected: (connected: boolean, why: string) => void; // why: what to tell the user while it is not
}

const UNREACHABLE = "not connected";
const REFUSED = location.pathname === "/"
  ? "refused: open the address that fcu web printed"
  : "refused: open the launcher's tile, or the address that fcu web printed"; // below a path, the board may belong to a hub

// A session over a WebSocket, found again when the server has been restarted. A worker that runs the board in the
// browser would be another Session.
export function overWebSocket(): Session {
  let socket: WebSocket | null = null;
  const session: Session = {
    send(command) {
      if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(command));
    },
    onEvent: () => undefined,
    onConnected: () => undefined,
  };
  const connect = (): void => {
    const secret = token();
    if (!secret) {
      session.onConnected(false, REFUSED);
      return;
    }
    const opened = new WebSocket(new URL("session", location.href.replace(/^http/, "ws")), protocols(secret));
    let accepted = false;
    socket = opened;
    opened.onopen = () => {
      accepted = true;
      session.onConnected(true, "");
    };
    opened.onmessage = (message) => session.onEvent(JSON.parse(String(message.data)) as Event);
    opened.onclose = () => {
      if (!accepted) return void askAgain();
      session.onConnected(false, UNREACHABLE);
      window.setTimeout(connect, 500);
    };
  };
  // A browser does not tell why a socket was not opened: if the server sends the page's files but opens no socket, it refuses the socket.
  // JupyterHub answers requests for images and scripts ("no-cors"), and redirects all others to its login page.
  const askAgain = async (): Promise<void> => {
    const refused = await fetch("icon.svg", { mode: "no-cors", redirect: "error" }).then((response) => response.ok, () => false);
    session.onConnected(false, refused ? REFUSED : UNREACHABLE);
    window.setTimeout(connect, refused ? 5000 : 500);
  };
  onNewToken(() => location.reload());
  window.setTimeout(connect); // when the page has said what to do with what comes
  return session;
}
