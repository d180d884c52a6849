// The page: a header with the run's controls, the board and the hand at the left, plot and terminal in the middle, and
// at the right what is inside.

import "@xterm/xterm/css/xterm.css";
import "uplot/dist/uPlot.min.css";
import "./app.css";
import { boardIn3d } from "./board3d";
import { button, download, el, fixed, setText } from "./dom";
import { ExerciseView } from "./exercise";
import { FailureStrip } from "./failure";
import { Hand, HAND_KEYS, MAGNET_KEYS } from "./hand";
import { KeyDialog, Tour, type Shortcut } from "./help";
import { History } from "./history";
import { boardIn2d } from "./horizon";
import { BusView, DiagnosisView, PinView, ScenarioView } from "./panels";
import { Plot } from "./plot";
import { RegisterView } from "./registers";
import { overWebSocket, type Command, type Entry, type Event, type Finding, type State, type Status } from "./protocol";
import { setSources } from "./source";
import { Serial } from "./serial";
import { TabRow } from "./tabs";
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
const pins = new PinView(act);
const scenario = new ScenarioView((name) => send({ type: "play", scenario: name }));
const diagnosis = new DiagnosisView();
const exercise = new ExerciseView((name) => send({ type: "check", exercise: name }));
const failure = new FailureStrip(() => open("diagnosis"), () => send({ type: "reset" }));

let status: Status | null = null;
let findings: Finding[] = [];

const leds = el("div", { class: "leds", "aria-label": "LEDs" });
const lamps: Record<string, HTMLElement> = {};
const time = el("output", { id: "time", title: "Virtual time since power-on" }, "0.000 s");
const pace = el("span", { class: "pace", id: "pace", title: "Ratio of virtual to wall time" });
const firmware = el("select", { id: "firmware", change: () => firmware.value && send({ type: "firmware", name: firmware.value }) });
const file = el("input", { type: "file", accept: ".elf,.axf,.out,.hex,.bin", hidden: true, "aria-label": "Firmware file", change: () => void upload(file.files?.[0]) });
const runner = button("Pause", "Pause or continue (Space)", () => send({ type: status?.state === "running" ? "pause" : "run" }), { id: "runner", class: "primary" });
const speed = el("select", { id: "speed", "aria-label": "Speed", title: "Ratio of virtual to wall time", change: () => send({ type: "speed", factor: SPEEDS.find(([name]) => name === speed.value)?.[1] ?? null }) },
  ...SPEEDS.map(([name]) => el("option", { value: name, selected: name === "1" }, name === "max" ? "max" : `${name} ×`)));
const notices = el("div", { class: "notices", role: "status", "aria-live": "polite", id: "notices" });
const connection = el("span", { class: "connection", id: "connection" });
const badge = el("span", { class: "badge", hidden: true });

const panes: [string, string, HTMLElement][] = [
  ["world", "World", world.element], ["registers", "Registers", registers.element], ["bus", "Bus", bus.element], ["pins", "Pins", pins.element],
  ["scenario", "Scenario", scenario.element], ["diagnosis", "Diagnosis", diagnosis.element],
];
let pane = "world";
let greeted = false; // by a status
let toured = false;
const tabs = new TabRow("Inside", open);
tabs.offer(panes.map(([id, name]) => ({ id, name, attributes: { id: `tab-${id}`, "aria-controls": `pane-${id}` }, more: id === "diagnosis" ? badge : undefined })));
for (const [id, , element] of panes) {
  element.id = `pane-${id}`;
  element.setAttribute("role", "tabpanel");
  element.setAttribute("aria-labelledby", `tab-${id}`);
  element.tabIndex = 0; // so that the keys scroll it
  element.classList.add("pane");
}

function open(id: string): void {
  pane = id;
  for (const [one, , element] of panes) element.hidden = one !== id;
  tabs.select(id);
  watch();
}

function watch(): void {
  send({ type: "watch", variables: plot.watched, registers: pane === "registers" ? registers.part : null, bus: pane === "bus", pins: pane === "pins" });
}

// -- Keys, and the tour ---------------------------------------------------------------------------------------

interface Key extends Shortcut { key: string; press: () => void }
const PAGE_KEYS: Key[] = [
  { key: " ", keys: "Space", text: "pause or run", press: () => runner.click() },
  { key: ".", keys: ".", text: "run to the next tick of the callback", press: () => send({ type: "step", of: "tick" }) },
  { key: ",", keys: ",", text: "run to the next line of text", press: () => send({ type: "step", of: "line" }) },
  { key: "?", keys: "?", text: "show these keys", press: () => keys.open() },
];
const tour = new Tour();
const keys = new KeyDialog([
  ["The page", PAGE_KEYS], ["The board, when it has the focus", HAND_KEYS], ["The magnet, when its button has the focus", MAGNET_KEYS],
  ["Elsewhere", [
    { keys: "← → Home End", text: "in a row of tabs: choose another tab" },
    { keys: "Enter", text: "in Find: next match; with Shift the previous match" },
    { keys: "Double-click", text: "in the plot: end the zoom and follow the run" },
  ]],
], () => tour.start());

const view = el("div", { class: "view" }, picture.element, leds,
  el("p", { class: "keys" }, "drag turns · wheel lifts · press ? for keys"));
document.getElementById("app")?.append(
  el("header", { class: "bar" },
    el("h1", { class: "name" }, "fcu", el("span", { id: "board-name" })),
    el("label", { class: "pick" }, el("span", {}, "Firmware"), firmware), button("Open…", "Load an ELF, HEX or BIN file, or drop one anywhere on the page", () => file.click()), file,
    el("span", { class: "gap" }),
    runner,
    el("span", { class: "joined", role: "group", "aria-label": "Step" },
      button("Tick", "Run to the next tick of the callback (.)", () => send({ type: "step", of: "tick" }), { id: "step-tick" }),
      button("Line", "Run to the next line of text (,)", () => send({ type: "step", of: "line" }), { id: "step-line" }),
      button("1 s", "Run for one second", () => send({ type: "step", of: "second" }), { id: "step-second" })),
    speed, button("Reset", "Power on again; the board keeps its attitude and place", () => send({ type: "reset" }), { id: "reset" }),
    el("span", { class: "clock" }, time, pace),
    button("Save run", "Save all actions since power-on as a scenario (TOML)", () => send({ type: "record" }), { id: "record" }),
    button("◐", "Light or dark theme", toggleTheme, { id: "theme", class: "quiet", "aria-label": "Light or dark theme" }),
    button("?", "Keys and tour (?)", () => keys.open(), { id: "help", class: "quiet", "aria-label": "Keys and tour (?)" }), connection),
  el("main", {},
    el("section", { class: "left", "aria-label": "The board" }, failure.element, view, hand.controls),
    el("section", { class: "middle", "aria-label": "Plot and terminal" }, plot.element, serial.element),
    el("section", { class: "right", "aria-label": "Exercise and inside" }, exercise.element,
      el("div", { class: "inside", id: "inside" }, tabs.element, ...panes.map(([, , element]) => element))),
    notices, tour.element, keys.element),
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
      exercise.offer(event.exercises);
      hand.offer(event.gestures);
      registers.offer(event.parts);
      plot.declare(event.outputs);
      world.declare(event.outputs);
      world.tellWays(event.ways);
      if (!toured) tour.startOnFirstVisit(); // with all parts of the page, as this board has them
      toured = true;
      leds.replaceChildren(...event.leds.map((name) => (lamps[name] = el("span", { class: "led", "data-led": name, "data-on": "false" }, el("i", {}), name))));
      break;
    case "status":
      if (status && status.run !== event.run) {
        history.clear();
        findings = [];
      }
      status = event;
      setSources(event.sources);
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
    case "past":
      history.replace(event);
      plot.refresh();
      break;
    case "unknown":
      plot.refuse(event.variables);
      break;
    case "checked":
      exercise.show(event);
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
  const [other, ...shipped] = firmware.options; // the first option is for what is not shipped, such as a file
  const known = shipped.some((option) => option.value === now.firmware);
  if (other) {
    other.value = known ? "" : now.firmware;
    other.hidden = known;
    setText(other, other.value);
  }
  firmware.value = now.firmware;
  firmware.title = now.file ? `${now.file}, loaded again after a change` : now.firmware;
  setText(runner, now.state === "running" ? "Pause" : "Run");
  runner.disabled = now.state === "failed" || now.state === "halted";
  document.body.dataset["state"] = now.state;
  speed.value = SPEEDS.find(([, factor]) => factor === now.speed)?.[0] ?? "1";
  plot.offer(now.variables);
  registers.offerPeripherals(now.peripherals);
  scenario.status(now);
  if (now.scenario && !greeted) open("scenario"); // its question, and its verdicts as they fall
  greeted = true;
  showDiagnosis();
}

function showState(state: State): void {
  setText(time, `${fixed(state.t_s, 3)} s`);
  setText(pace, stopped() ? "stopped" : status?.state === "running" ? (state.pace ? `${fixed(state.pace, 2)} ×` : "") : status?.state === "halted" ? "held by gdb" : status?.state ?? "");
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

// Why the firmware runs no more; empty while it runs.
function stopped(): string {
  if (status?.state === "failed") return status.problem.split("\n")[0] || "it has failed";
  return findings.find((one) => one.fatal)?.summary ?? "";
}

function showDiagnosis(): void {
  diagnosis.show(findings, status?.problem ?? "", status?.notes ?? []);
  const count = findings.length + (status?.problem ? 1 : 0), why = stopped();
  badge.hidden = !count;
  setText(badge, String(count));
  badge.title = `${count} ${count === 1 ? "finding" : "findings"}`;
  document.body.dataset["stopped"] = String(why !== "");
  failure.show(why);
  if (why) {
    setText(pace, "stopped");
    serial.markEnd(why);
  } else serial.unmarkEnd();
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
  if (chosen.size > LARGEST_FIRMWARE) return notify(`${chosen.name} must have at most 8 MiB`, "error");
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
  const takesKey = target.closest("input, select, textarea, dialog, .screen") || (event.key === " " && target.closest("button"));
  if (takesKey || event.ctrlKey || event.metaKey || event.altKey) return;
  const key = PAGE_KEYS.find((one) => one.key === event.key);
  if (key) {
    key.press();
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
