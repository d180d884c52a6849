// The page: a header with the run's controls, the board and the hand at the left, plot and terminal in the middle, and
// at the right what is inside.

import "@xterm/xterm/css/xterm.css";
import "uplot/dist/uPlot.min.css";
import "./app.css";
import { boardIn3d } from "./board3d";
import { button, download, el, fixed, setText } from "./dom";
import { Hand } from "./hand";
import { History } from "./history";
import { boardIn2d } from "./horizon";
import { BusView, DiagnosisView, PinView, ScenarioView } from "./panels";
import { Plot } from "./plot";
import { RegisterView } from "./registers";
import { overWebSocket, type Command, type Entry, type Event, type Finding, type State, type Status } from "./protocol";
import { Serial } from "./serial";
import { World } from "./world";

const SPEEDS: [string, number | null][] = [["0.01", 0.01], ["0.1", 0.1], ["0.5", 0.5], ["1", 1], ["2", 2], ["5", 5], ["10", 10], ["max", null]];
const LARGEST_FIRMWARE = 8 << 20;

const session = overWebSocket();
const send = (command: Command): void => session.send(command);
let doing = 0;
const act = (entry: Entry): void => send({ type: "do", entry, id: ++doing });

// -- What there is to see -------------------------------------------------------------------------------------

const history = new History();
const picture = (new URLSearchParams(location.search).has("2d") ? null : boardIn3d()) ?? boardIn2d();
const hand = new Hand(picture, act);
const serial = new Serial(act);
const plot = new Plot(history);
const world = new World(act);
const registers = new RegisterView();
const bus = new BusView();
const pins = new PinView();
const scenario = new ScenarioView((name) => send({ type: "play", scenario: name }));
const diagnosis = new DiagnosisView();

let status: Status | null = null;
let findings: Finding[] = [];

const leds = el("div", { class: "leds", "aria-label": "LEDs" });
const lamps: Record<string, HTMLElement> = {};
const time = el("output", { id: "time", title: "Virtual time since power-on" }, "0.000 s");
const pace = el("span", { class: "pace", id: "pace", title: "Virtual over wall time" });
const firmware = el("select", { id: "firmware", "aria-label": "Firmware", change: () => firmware.value && send({ type: "firmware", name: firmware.value }) });
const file = el("input", { type: "file", accept: ".elf,.axf,.out,.hex,.bin", hidden: true, "aria-label": "Firmware file", change: () => void upload(file.files?.[0]) });
const runner = button("Pause", "Pause, or go on (Space)", () => send({ type: status?.state === "running" ? "pause" : "run" }), { id: "runner", class: "primary" });
const speed = el("select", { id: "speed", "aria-label": "Speed", title: "Virtual over wall time", change: () => send({ type: "speed", factor: SPEEDS.find(([name]) => name === speed.value)?.[1] ?? null }) },
  ...SPEEDS.map(([name]) => el("option", { value: name, selected: name === "1" }, name === "max" ? "max" : `${name} ×`)));
const notices = el("div", { class: "notices", role: "status", "aria-live": "polite", id: "notices" });
const connection = el("span", { class: "connection", id: "connection" });
const badge = el("span", { class: "badge", hidden: true });

const panes: [string, string, HTMLElement][] = [
  ["world", "World", world.element], ["registers", "Registers", registers.element], ["bus", "Bus", bus.element], ["pins", "Pins", pins.element],
  ["scenario", "Scenario", scenario.element], ["diagnosis", "Diagnosis", diagnosis.element],
];
let pane = "world";
let greeted = false;
const tabs = el("div", { class: "tabs", role: "tablist", "aria-label": "What is inside" },
  ...panes.map(([id, name]) => el("button", { type: "button", role: "tab", id: `tab-${id}`, "aria-controls": `pane-${id}`, click: () => open(id) }, name)));
tabs.querySelector("#tab-diagnosis")?.append(badge);
for (const [id, , element] of panes) {
  element.id = element.id || `pane-${id}`;
  element.setAttribute("role", "tabpanel");
  element.classList.add("pane");
}

function open(id: string): void {
  pane = id;
  panes.forEach(([one, , element], index) => {
    element.hidden = one !== id;
    tabs.children[index]?.setAttribute("aria-selected", String(one === id));
  });
  watch();
}

function watch(): void {
  send({ type: "watch", variables: plot.watched, registers: pane === "registers" ? registers.part : null, bus: pane === "bus", pins: pane === "pins" });
}

const view = el("div", { class: "view" }, picture.element, leds,
  el("p", { class: "keys" }, "drag turns · wheel lifts · keys ← → ↑ ↓ Q E"));
document.getElementById("app")?.append(
  el("header", { class: "bar" },
    el("strong", { class: "name" }, "fcu", el("span", { id: "board-name" })),
    el("label", { class: "pick" }, el("span", {}, "Firmware"), firmware), button("Open…", "Load an ELF, HEX or BIN file; or drop it anywhere on the page", () => file.click()), file,
    el("span", { class: "gap" }),
    runner,
    el("span", { class: "joined", role: "group", "aria-label": "Step" },
      button("Tick", "Run to the next tick of the callback (.)", () => send({ type: "step", of: "tick" }), { id: "step-tick" }),
      button("Line", "Run to the next line of text (,)", () => send({ type: "step", of: "line" }), { id: "step-line" }),
      button("1 s", "Run for a second", () => send({ type: "step", of: "second" }), { id: "step-second" })),
    speed, button("Reset", "Power on again; the board stays where it is held", () => send({ type: "reset" }), { id: "reset" }),
    el("span", { class: "clock" }, time, pace),
    button("Save run", "Save what was done since power-on as a scenario (TOML)", () => send({ type: "record" }), { id: "record" }),
    button("◐", "Light or dark", toggleTheme, { id: "theme", class: "quiet" }), connection),
  el("main", {},
    el("section", { class: "left", "aria-label": "The board" }, view, hand.controls),
    el("section", { class: "middle" }, plot.element, serial.element),
    el("section", { class: "right" }, tabs, ...panes.map(([, , element]) => element))),
  notices,
  el("div", { class: "drop", hidden: true, id: "drop" }, el("p", {}, "Drop the firmware: ELF, HEX or BIN")));

// -- What the session says ------------------------------------------------------------------------------------

session.onConnected = (connected, why) => {
  document.body.classList.toggle("lost", !connected);
  setText(connection, why);
  if (connected) watch();
};

session.onEvent = (event: Event) => {
  switch (event.type) {
    case "hello":
      setText(document.getElementById("board-name") ?? connection, event.board);
      document.title = `${event.board} – fcu`;
      firmware.replaceChildren(el("option", { value: "", hidden: true }), ...Object.entries(event.firmware).map(([name, text]) => el("option", { value: name, title: text }, name)));
      scenario.offer(event.scenarios);
      registers.offer(event.parts);
      plot.declare(event.outputs);
      world.declare(event.outputs);
      world.tellWays(event.ways);
      leds.replaceChildren(...event.leds.map((name) => (lamps[name] = el("span", { class: "led", "data-led": name, "data-on": "false" }, el("i", {}), name))));
      break;
    case "status":
      if (status && status.run !== event.run) history.clear();
      status = event;
      showStatus(event);
      break;
    case "state":
      showState(event);
      break;
    case "text":
      serial.show(event);
      break;
    case "printed":
      history.addPrinted(event);
      break;
    case "declared":
      registers.declare(event.part);
      break;
    case "pins":
      pins.show(event);
      break;
    case "registers":
      registers.show(event);
      break;
    case "bus":
      bus.show(event);
      break;
    case "verdicts":
      scenario.show(event);
      break;
    case "findings":
      findings = event.findings;
      showDiagnosis();
      break;
    case "recorded":
      download("session.toml", new Blob([event.text], { type: "application/toml" }));
      break;
    case "notice":
      notify(event.text, event.kind);
      break;
  }
};

function showStatus(now: Status): void {
  const known = [...firmware.options].some((option) => option.value === now.firmware);
  const other = firmware.options[0];
  if (other) {
    other.value = known ? "" : now.firmware;
    other.hidden = known;
    setText(other, known ? "" : now.firmware);
  }
  firmware.value = now.firmware;
  firmware.title = now.file ? `${now.file}, loaded again when it changes` : now.firmware;
  setText(runner, now.state === "running" ? "Pause" : "Run");
  runner.disabled = now.state === "failed" || now.state === "halted";
  document.body.dataset["state"] = now.state;
  speed.value = SPEEDS.find(([, factor]) => factor === now.speed)?.[0] ?? "1";
  plot.offer(now.variables);
  registers.offerBlocks(now.blocks);
  scenario.status(now);
  if (now.scenario && !greeted) open("scenario"); // its question, and its verdicts as they fall
  greeted = true;
  showDiagnosis();
}

function showState(state: State): void {
  setText(time, `${fixed(state.t_s, 3)} s`);
  setText(pace, status?.state === "running" ? (state.pace ? `${fixed(state.pace, 2)} ×` : "") : status?.state === "halted" ? "held by gdb" : status?.state ?? "");
  for (const [name, on] of Object.entries(state.leds)) {
    const lamp = lamps[name];
    if (lamp) lamp.dataset["on"] = String(on);
  }
  picture.show(state.truth.rotation, state.truth.altitude_m, state.leds, state.truth.magnet_m);
  hand.follow(state.truth);
  if (pane === "world") world.show(state);
  scenario.time(state.t_s);
  history.addState(state);
  plot.refresh();
  document.body.dataset["done"] = String(state.done);
}

function showDiagnosis(): void {
  diagnosis.show(findings, status?.problem ?? "", status?.notes ?? []);
  const count = findings.length + (status?.problem ? 1 : 0);
  badge.hidden = !count;
  setText(badge, String(count));
}

function notify(text: string, kind: "error" | "info"): void {
  const last = notices.lastElementChild;
  if (last?.textContent === text) last.remove(); // the same again, as of each movement of a mouse
  const line = el("p", { class: kind }, text);
  notices.append(line);
  while (notices.children.length > 3) notices.firstChild?.remove();
  window.setTimeout(() => line.remove(), kind === "error" ? 9000 : 3500);
}

// -- Firmware onto the page, keys, theme, size ----------------------------------------------------------------

async function upload(chosen: File | undefined): Promise<void> {
  file.value = "";
  if (!chosen) return;
  if (chosen.size > LARGEST_FIRMWARE) return notify(`${chosen.name} is larger than 8 MiB`, "error");
  const bytes = new Uint8Array(await chosen.arrayBuffer());
  let text = "";
  for (let at = 0; at < bytes.length; at += 0x8000) text += String.fromCharCode(...bytes.subarray(at, at + 0x8000));
  send({ type: "upload", name: chosen.name, data: btoa(text) });
}

const drop = document.getElementById("drop") as HTMLElement;
window.addEventListener("dragover", (event) => {
  event.preventDefault();
  drop.hidden = false;
});
window.addEventListener("dragleave", (event) => {
  if (!event.relatedTarget) drop.hidden = true;
});
window.addEventListener("drop", (event) => {
  event.preventDefault();
  drop.hidden = true;
  void upload(event.dataTransfer?.files[0]);
});
window.addEventListener("keydown", (event) => {
  const target = event.target as HTMLElement;
  if (target.closest("input, select, textarea, button, .screen") || event.ctrlKey || event.metaKey || event.altKey) return;
  const keys: Record<string, () => void> = {
    " ": () => runner.click(), ".": () => send({ type: "step", of: "tick" }), ",": () => send({ type: "step", of: "line" }),
  };
  const key = keys[event.key];
  if (key) {
    key();
    event.preventDefault();
  }
});

function theme(): string {
  return localStorage.getItem("fcu-theme") ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
}

function toggleTheme(): void {
  localStorage.setItem("fcu-theme", theme() === "dark" ? "light" : "dark");
  restyle();
}

function restyle(): void {
  document.documentElement.dataset["theme"] = theme();
  picture.restyle();
  serial.restyle();
  plot.restyle();
}

function resize(): void {
  picture.resize();
  serial.resize();
  plot.resize();
}

document.documentElement.dataset["theme"] = theme();
serial.open();
plot.onWatch = watch;
registers.onPart = watch;
open(pane);
restyle();
resize();
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", restyle);
new ResizeObserver(resize).observe(document.body);
for (const element of [view, plot.element, serial.element]) new ResizeObserver(resize).observe(element);
document.body.dataset["ready"] = "true";
