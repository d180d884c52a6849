// What is shown beside the plot: the world in numbers, registers, bus, scenario, diagnosis, and ways in from elsewhere.

import { el, fixed, setText } from "./dom";
import type { Bus, Entry, Field, Finding, Part, Registers, State, Status, Verdicts } from "./protocol";

// -- The world, in numbers -----------------------------------------------------------------------------------

type Cells = HTMLTableCellElement[];

export class World {
  readonly element = el("div", { class: "world" });
  private readonly rows: Record<string, Cells> = {};
  private readonly bar = el("i", {});
  private readonly ways = el("ul", { class: "ways", id: "ways" });
  private readonly figures: Record<string, HTMLElement> = {};

  constructor(act: (entry: Entry) => void) {
    const table = el("table", { class: "numbers" });
    const head = (...names: string[]): void => void table.append(el("tr", {}, ...["", ...names].map((name) => el("th", { scope: "col" }, name))));
    const row = (id: string, name: string, unit: string, ids: string[] = ["x", "y", "z"]): void => {
      const cells = ids.map((one) => el("td", { id: `num-${id}-${one}` }));
      this.rows[id] = cells;
      table.append(el("tr", {}, el("th", { scope: "row" }, name), ...cells, el("td", { class: "unit" }, unit)));
    };
    head("roll", "pitch", "yaw", "");
    row("attitude", "Attitude", "°", ["roll", "pitch", "yaw"]);
    head("X", "Y", "Z", "");
    row("rate", "Rate", "°/s");
    row("acc", "Acceleration", "mg");
    row("mag", "Field", "mG");
    table.append(el("tr", { class: "space" }, el("th", { colspan: "5", scope: "col" }, "read by the firmware, sensors' own axes")));
    row("read-gyr", "LSM6DSL", "mdps");
    row("read-acc", "", "mg");
    row("read-mag", "LIS2MDL", "mG");
    row("read-pre", "LPS22HB", "hPa", ["value"]);
    this.rows["read-pre"]?.[0]?.after(el("td", {}), el("td", {}));
    const setting = (id: string, name: string, unit: string, step: string, entry: (value: number) => Entry): HTMLElement => {
      const input = el("input", {
        type: "number", step, id: `set-${id}`, "aria-label": name,
        change: () => { if (input.value !== "") act(entry(Number(input.value))); },
      });
      this.figures[`set-${id}`] = input;
      return el("label", { class: "setting" }, el("span", {}, name), input, el("span", { class: "unit" }, unit));
    };
    const field = ["north", "east", "down"].map((name) => el("input", { type: "number", step: "0.5", "aria-label": `Field ${name}, microtesla`, title: `${name}, µT` }));
    field.forEach((input, index) => (input.value = ["21.5", "0", "43"][index] ?? "0"));
    const setField = (): void => {
      const [north_ut = 0, east_ut = 0, down_ut = 0] = field.map((input) => Number(input.value));
      act({ do: "set_field", field: { north_ut, east_ut, down_ut } });
    };
    field.forEach((input) => input.addEventListener("change", setField));
    const figure = (id: string, name: string): HTMLElement => {
      const value = el("dd", { id: `fig-${id}` });
      this.figures[id] = value;
      return el("div", {}, el("dt", {}, name), value);
    };
    this.element.append(table,
      el("h3", {}, "Surroundings"),
      el("div", { class: "settings" },
        setting("altitude", "Height", "m", "0.1", (metres) => ({ do: "follow_altitude", metres, time_constant: "300ms" })),
        setting("pressure", "Pressure", "hPa", "0.1", (pressure_hpa) => ({ do: "set_pressure", pressure_hpa })),
        setting("temperature", "Temperature", "°C", "0.5", (temperature_degc) => ({ do: "set_temperature", temperature_degc })),
        el("div", { class: "setting earth" }, el("span", { title: "The Earth's field: north, east, down" }, "Field"), ...field, el("span", { class: "unit" }, "µT N E D"))),
      el("h3", {}, "Timing"),
      el("div", { class: "callback", title: "Time in the callback of each period" }, el("span", { class: "bar" }, this.bar), (this.figures["callback"] = el("span", { id: "fig-callback" }))),
      el("dl", { class: "figures" }, figure("rate", "Timer"), figure("ticks", "Ticks"), figure("late", "Late, lost"), figure("wait", "Longest wait"), figure("bus", "Sensor bus"), figure("serial", "Serial line")),
      el("h3", {}, "From elsewhere"), this.ways);
  }

  show({ truth, samples, load }: State): void {
    this.put("attitude", [truth.roll_deg, truth.pitch_deg, truth.yaw_deg], 1);
    this.put("rate", truth.rate_dps, 1);
    this.put("acc", truth.acc_mg, 0);
    this.put("mag", truth.mag_mgauss, 0);
    this.put("read-gyr", samples["GYR"], 0);
    this.put("read-acc", samples["ACC"], 0);
    this.put("read-mag", samples["MAG"], 0);
    this.put("read-pre", samples["PRE"], 2);
    this.set("altitude", truth.altitude_m, 2);
    this.set("pressure", truth.pressure_hpa, 2);
    this.set("temperature", truth.temperature_degc, 1);
    const of = (name: string): number => load[name] ?? 0;
    const share = of("callback_share");
    this.bar.style.width = `${Math.min(100, 100 * share)}%`;
    this.bar.classList.toggle("full", share > 0.97);
    const known = of("callback_ms") > 0;
    this.say("callback", known ? `callback ${fixed(of("callback_ms"), 2)} of ${fixed(of("period_ms"), 2)} ms, ${fixed(100 * share, 0)} %` : "callback: not measured yet (only of built firmware)");
    this.say("rate", of("rate_hz") ? `${fixed(of("rate_hz"), 1)} Hz` : "stopped");
    this.say("ticks", String(of("ticks")));
    this.say("late", `${of("late")}, ${of("lost")}`);
    this.say("wait", `${fixed(of("longest_wait_ms"), 3)} ms`);
    const hertz = of("bus_hz");
    this.say("bus", hertz ? `${of("bus_is_i2c") ? "I2C" : "SPI"} ${hertz >= 1e6 ? `${fixed(hertz / 1e6, 3)} MHz` : `${fixed(hertz / 1e3, 0)} kHz`}` : "not used");
    this.say("serial", `${of("baud")} baud, ${fixed(100 * of("line_share"), 1)} % busy`);
  }

  tellWays(lines: string[]): void {
    const serial = lines.length ? lines : ["serial port: start with fcu web FIRMWARE --serial port (or tcp)"];
    const debug = "debugger: fcu run FIRMWARE --gdb 3333, then in gdb: target remote 127.0.0.1:3333";
    this.ways.replaceChildren(...[...serial, debug].map((line) => el("li", {}, line)));
  }

  private put(id: string, values: number[] | undefined, digits: number): void {
    this.rows[id]?.forEach((cell, index) => {
      const value = values?.[index];
      setText(cell, value === undefined ? "–" : fixed(value, digits));
    });
  }

  private set(id: string, value: number, digits: number): void {
    const input = this.figures[`set-${id}`] as HTMLInputElement | undefined;
    if (input && document.activeElement !== input) input.value = fixed(value, digits);
  }

  private say(id: string, text: string): void {
    const element = this.figures[id];
    if (element) setText(element, text);
  }
}

// -- Registers, decoded with the declarations that came from the session ---------------------------------------

export class RegisterView {
  readonly element = el("div", { class: "registers" });
  part = "";
  onPart: () => void = () => undefined;
  private readonly choice = el("div", { class: "tabs", role: "tablist", "aria-label": "Sensor" });
  private readonly body = el("tbody");
  private readonly place = el("p", { class: "hint" });
  private readonly changedOnly: HTMLInputElement;
  private parts: Part[] = [];
  private before = "";
  private rows: { row: HTMLTableRowElement; value: HTMLElement; fields: { field: Field; cell: HTMLElement }[] }[] = [];

  constructor() {
    this.changedOnly = el("input", { type: "checkbox", checked: true, change: () => this.hide() });
    this.element.append(this.choice,
      el("div", { class: "row" }, this.place, el("label", { class: "check" }, this.changedOnly, " set by the firmware only")),
      el("table", { class: "register-table" }, this.body));
  }

  declare(parts: Part[]): void {
    this.parts = parts;
    this.choice.replaceChildren(...parts.map((part) => el("button", { type: "button", role: "tab", "data-part": part.name, click: () => this.choose(part.name) }, part.name)));
    this.choose(this.part || (parts[0]?.name ?? ""));
  }

  private choose(name: string): void {
    const part = this.parts.find((one) => one.name === name);
    if (!part) return;
    this.part = name;
    this.before = "";
    for (const tab of this.choice.children) tab.setAttribute("aria-selected", String(tab.getAttribute("data-part") === name));
    setText(this.place, part.place);
    this.rows = part.registers.map((register) => {
      const value = el("td", { class: "value" });
      const fields = register.fields.map((field) => ({ field, cell: el("span", { class: "field", title: `${field.name}${field.doc ? `: ${field.doc}` : ""}` }) }));
      const row = el("tr", { "data-register": register.name, title: register.doc },
        el("td", { class: "address" }, register.address.toString(16).padStart(2, "0").toUpperCase()),
        el("th", { scope: "row" }, register.name), value, el("td", {}, ...fields.map((one) => one.cell)));
      return { row, value, fields };
    });
    this.body.replaceChildren(...this.rows.map((one) => one.row));
    this.onPart();
  }

  show({ part, bytes }: Registers): void {
    const declared = this.parts.find((one) => one.name === part);
    if (part !== this.part || !declared) return;
    declared.registers.forEach((register, index) => {
      const shown = this.rows[index];
      if (!shown) return;
      const now = valueAt(bytes, register.address, register.size), then = this.before ? valueAt(this.before, register.address, register.size) : now;
      setText(shown.value, now.toString(16).padStart(2 * register.size, "0").toUpperCase());
      shown.row.dataset["reset"] = String(now === register.reset);
      flash(shown.value, now !== then);
      for (const { field, cell } of shown.fields) {
        const value = bitsOf(now, field);
        setText(cell, field.msb === field.lsb ? field.name : `${field.name} ${value}`);
        cell.classList.toggle("off", value === 0);
        flash(cell, value !== bitsOf(then, field));
      }
    });
    this.before = bytes;
    this.hide();
  }

  private hide(): void {
    for (const { row } of this.rows) row.hidden = this.changedOnly.checked && row.dataset["reset"] !== "false";
  }
}

function valueAt(bytes: string, address: number, size: number): number {
  let value = 0;
  for (let index = size - 1; index >= 0; index--) value = value * 256 + Number.parseInt(bytes.substr(2 * (address + index), 2) || "0", 16);
  return value;
}

function bitsOf(value: number, { msb, lsb }: Field): number {
  return Math.floor(value / 2 ** lsb) % 2 ** (msb - lsb + 1);
}

function flash(element: HTMLElement, changed: boolean): void {
  if (!changed) return;
  element.classList.remove("changed");
  void element.offsetWidth; // so that the animation begins anew
  element.classList.add("changed");
}

// -- The bus -------------------------------------------------------------------------------------------------

export class BusView {
  readonly element = el("div", { class: "bus" });
  private readonly body = el("tbody");

  constructor() {
    this.element.append(
      el("p", { class: "hint" }, "The latest transfers. Pause, and step tick by tick, to see every one."),
      el("table", { class: "bus-table" }, el("thead", {}, el("tr", {}, ...["t (s)", "", "register", "bytes", "meaning"].map((name) => el("th", { scope: "col" }, name)))), this.body));
  }

  show({ transfers }: Bus): void {
    this.body.replaceChildren(...transfers.toReversed().map((one) => el("tr", { class: one.result === "ok" ? "" : "bad" },
      el("td", {}, fixed(one.t_s, 6)), el("td", { class: one.way }, one.way === "read" ? "R" : "W"),
      el("td", {}, `${one.device} ${one.register}`), el("td", { class: "bytes" }, one.bytes),
      el("td", {}, one.result === "ok" ? one.meaning || `${one.count} byte${one.count === 1 ? "" : "s"}` : one.result))));
  }
}

// -- The scenario --------------------------------------------------------------------------------------------

export class ScenarioView {
  readonly element = el("div", { class: "scenario" });
  private readonly select: HTMLSelectElement;
  private readonly question = el("p", { class: "question", id: "question" });
  private readonly progress = el("progress", { max: "1", value: "0", "aria-label": "How far the scenario is" });
  private readonly list = el("ul", { class: "verdicts", id: "verdicts" });
  private readonly count = el("p", { class: "count", id: "verdict-count" });
  private duration = 0;

  constructor(play: (scenario: string | null) => void) {
    this.select = el("select", { id: "scenario", "aria-label": "Scenario", change: () => play(this.select.value || null) });
    this.element.append(
      el("div", { class: "row" }, this.select, el("button", { type: "button", click: () => play(this.select.value || null) }, "From the start")),
      this.question, this.progress, this.count, this.list);
  }

  offer(scenarios: Record<string, string>): void {
    this.select.replaceChildren(el("option", { value: "" }, "No scenario: by hand"), ...Object.entries(scenarios).map(([name, question]) => el("option", { value: name, title: question }, name)));
  }

  status(status: Status): void {
    this.select.value = status.scenario;
    this.duration = status.duration_s;
    setText(this.question, status.question || "Choose a scenario: the board is moved, and what the firmware prints and lights is judged.");
    this.progress.hidden = !status.scenario;
  }

  time(t: number): void {
    if (this.duration) this.progress.value = Math.min(1, t / this.duration);
  }

  show({ verdicts, over }: Verdicts): void {
    const signs = { open: "·", met: "✓", failed: "✗" };
    this.list.replaceChildren(...verdicts.map((one) => el("li", { class: one.state, "data-state": one.state },
      el("b", { "aria-label": one.state }, signs[one.state]), el("span", {}, el("code", {}, one.kind), ` ${one.says}`, one.found ? el("small", {}, one.found) : null))));
    const met = verdicts.filter((one) => one.state === "met").length;
    setText(this.count, verdicts.length ? `${met} of ${verdicts.length} expectations met${over ? "" : " so far"}` : "");
  }
}

// -- Diagnosis, and ways in ------------------------------------------------------------------------------------

export class DiagnosisView {
  readonly element = el("div", { class: "diagnosis", id: "diagnosis" });

  show(findings: Finding[], problem: string, notes: string[]): void {
    const parts: HTMLElement[] = [];
    if (problem) parts.push(el("p", { class: "fatal" }, problem));
    for (const one of findings) {
      parts.push(el("article", { class: one.fatal ? "fatal" : "" }, el("h3", {}, one.summary), el("pre", {}, one.details.join("\n"))));
    }
    for (const note of notes) parts.push(el("p", { class: "hint" }, note));
    if (!parts.length) parts.push(el("p", { class: "hint" }, "Nothing is seen to be wrong with the firmware."));
    this.element.replaceChildren(...parts);
  }
}
