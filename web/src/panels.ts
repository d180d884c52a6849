// What is shown beside the plot: bus, pins, scenario, diagnosis.

import { button, el, fixed, setText } from "./dom";
import type { Bus, Entry, Finding, Pin, Pins, Status, Verdicts } from "./protocol";
import { linked } from "./source";

// -- The bus -------------------------------------------------------------------------------------------------

export class BusView {
  readonly element = el("div", { class: "bus" });
  private readonly body = el("tbody");

  constructor() {
    this.element.append(
      el("p", { class: "hint" }, "The latest transfers. Pause and step by ticks to see all of them."),
      el("table", { class: "bus-table" }, el("thead", {}, el("tr", {}, ...["t (s)", "R/W", "register", "bytes", "meaning"].map((name) => el("th", { scope: "col" }, name)))), this.body));
  }

  show({ transfers }: Bus): void {
    this.body.replaceChildren(...transfers.toReversed().map((one) => el("tr", { class: one.result === "ok" ? "" : "bad" },
      el("td", {}, fixed(one.t_s, 6)), el("td", { class: one.way }, one.way === "read" ? "R" : "W"),
      el("td", {}, `${one.device} ${one.register}`), el("td", { class: "bytes" }, one.bytes),
      el("td", {}, one.result === "ok" ? one.meaning || `${one.count} byte${one.count === 1 ? "" : "s"}` : one.result))));
  }
}

// -- The pins ------------------------------------------------------------------------------------------------

export class PinView {
  readonly element = el("div", { class: "pins" });
  private readonly body = el("tbody");
  private before = new Map<string, number | null>();
  private rows = new Map<string, PinRow>();
  private shape = "";

  constructor(private readonly act: (entry: Entry) => void) {
    this.element.append(
      el("p", { class: "hint" }, "Levels, ten times a second. Pause and step by ticks to see every change; fcu run --vcd records the signals over time."),
      el("table", { class: "pin-table" }, el("thead", {}, el("tr", {}, ...["pin", "level", "mode", "connected to"].map((name) => el("th", { scope: "col" }, name)))), this.body));
  }

  show({ pins }: Pins): void {
    const shape = JSON.stringify(pins.map(({ name, use, mode, pull }) => [name, use, mode, pull]));
    if (shape !== this.shape) this.rows = this.newRows(pins); // else a focused button stays
    this.shape = shape;
    for (const { name, level } of pins) {
      const row = this.rows.get(name)!;
      const text = level === null ? "floats" : level ? "high" : "low";
      row.element.className = this.before.has(name) && this.before.get(name) !== level ? "moved" : "";
      row.element.dataset.level = text;
      setText(row.level, text);
    }
    this.before = new Map(pins.map(({ name, level }) => [name, level]));
  }

  private newRows(pins: Pin[]): Map<string, PinRow> {
    const rows = new Map(pins.map(({ name, use, mode, pull }) => {
      const level = el("span");
      const end = mode === "sensor" ? "test point" : pull === null ? use : this.press(name, pull);
      const element = el("tr", { "data-pin": name }, el("th", { scope: "row" }, name),
        el("td", { class: "level" }, el("i", {}), level), el("td", {}, mode === "sensor" ? "" : mode), el("td", {}, end));
      return [name, { element, level }] as const;
    }));
    this.body.replaceChildren(...[...rows.values()].map(({ element }) => element));
    return rows;
  }

  // A button between the pin and the opposite of its pull resistor.
  private press(pin: string, pull: number): HTMLElement {
    const title = `Connect ${pin} to ${pull ? "ground" : "the supply"} for 0.1 s, as a button does`;
    return button("Press", title, () => this.act({ do: "press_button", pin, level: 1 - pull }), { "data-press": pin, "aria-label": `Press the button at ${pin}` });
  }
}

interface PinRow { element: HTMLElement; level: HTMLElement }

// -- The scenario --------------------------------------------------------------------------------------------

export class ScenarioView {
  readonly element = el("div", { class: "scenario" });
  private readonly select: HTMLSelectElement;
  private readonly question = el("p", { class: "question", id: "question" });
  private readonly progress = el("progress", { max: "1", value: "0", "aria-label": "Progress of the scenario" });
  private readonly list = el("ul", { class: "verdicts", id: "verdicts" });
  private readonly count = el("p", { class: "count", id: "verdict-count" });
  private readonly offers = el("ul", { class: "offers", id: "scenarios", "aria-label": "Scenarios" });
  private duration = 0;

  constructor(private readonly play: (scenario: string | null) => void) {
    this.select = el("select", { id: "scenario", "aria-label": "Scenario", change: () => play(this.select.value || null) });
    this.element.append(
      el("div", { class: "row" }, this.select, el("button", { type: "button", click: () => play(this.select.value || null) }, "From the start")),
      this.question, this.progress, this.count, this.list, this.offers);
  }

  offer(scenarios: Record<string, string>): void {
    const named = Object.entries(scenarios);
    this.select.replaceChildren(el("option", { value: "" }, "No scenario: manual control"), ...named.map(([name, question]) => el("option", { value: name }, `${name}: ${question}`)));
    this.offers.replaceChildren(...named.map(([name, question]) => el("li", {},
      el("button", { type: "button", "data-scenario": name, click: () => this.play(name) }, el("code", {}, name), el("span", {}, question)))));
  }

  status(status: Status): void {
    this.select.value = status.scenario;
    this.duration = status.duration_s;
    setText(this.question, status.question || "Choose a scenario: it moves the board, and checks the firmware's text and LEDs.");
    this.progress.hidden = !status.scenario;
    this.offers.hidden = status.scenario !== "";
  }

  time(t: number): void {
    if (this.duration) this.progress.value = Math.min(1, t / this.duration);
  }

  show({ verdicts, over }: Verdicts): void {
    const signs = { open: "·", met: "✓", failed: "✗" };
    this.list.replaceChildren(...verdicts.map((one) => el("li", { class: one.state, "data-state": one.state },
      el("b", { role: "img", "aria-label": one.state }, signs[one.state]), el("span", {}, el("code", {}, one.kind), ` ${one.says}`, one.found ? el("small", {}, one.found) : null))));
    const met = verdicts.filter((one) => one.state === "met").length;
    setText(this.count, verdicts.length ? `${met} of ${verdicts.length} expectations met${over ? "" : " so far"}` : "");
  }
}

// -- Diagnosis, and ways in ------------------------------------------------------------------------------------

export class DiagnosisView {
  readonly element = el("div", { class: "diagnosis" });

  show(findings: Finding[], problem: string, notes: string[]): void {
    const parts: HTMLElement[] = [];
    if (problem) parts.push(el("p", { class: "fatal" }, problem));
    for (const one of findings) {
      parts.push(el("article", { class: one.fatal ? "fatal" : "" }, el("h3", {}, ...linked(one.summary)), el("pre", {}, ...linked(one.details.join("\n")))));
    }
    for (const note of notes) parts.push(el("p", { class: "hint" }, note));
    if (!parts.length) parts.push(el("p", { class: "hint" }, "No problems found."));
    this.element.replaceChildren(...parts);
  }
}
