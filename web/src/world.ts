// The world in numbers: where the board is, what the firmware reads of it, the surroundings, timing, and ways in from
// elsewhere.

import { el, fixed, setText } from "./dom";
import type { Entry, Output, State } from "./protocol";

type Cells = HTMLTableCellElement[];

export class World {
  readonly element = el("div", { class: "world" });
  private readonly read = el("table", { class: "numbers" });
  private readonly earth = el("div", { class: "setting earth" });
  private outputs: Output[] = [];
  private readonly rows: Record<string, Cells> = {};
  private readonly bar = el("i", {});
  private readonly ways = el("ul", { class: "ways", id: "ways" });
  private readonly figures: Record<string, HTMLElement> = {};

  constructor(act: (entry: Entry) => void) {
    const table = el("table", { class: "numbers" });
    const head = (...names: string[]): void => void table.append(el("tr", {}, ...["", ...names].map((name) => (name ? el("th", { scope: "col" }, name) : el("td")))));
    const row = (id: string, name: string, unit: string, ids: string[] = ["x", "y", "z"], title = ""): void => {
      const cells = ids.map((one) => el("td", { id: `num-${id}-${one}` }));
      this.rows[id] = cells;
      table.append(el("tr", { title }, el("th", { scope: "row" }, name), ...cells, el("td", { class: "unit" }, unit)));
    };
    head("roll", "pitch", "yaw", "");
    row("attitude", "Attitude", "°", ["roll", "pitch", "yaw"]);
    head("X", "Y", "Z", "");
    row("rate", "Rate", "°/s");
    row("acc", "Acceleration", "mg");
    row("mag", "Field at sensor", "mG", ["x", "y", "z"], "The field that the magnetometer measures, in the board's axes: the Earth's, hard and soft iron, magnets, motors");
    table.append(el("tr", { class: "space" }, el("th", { colspan: "5", scope: "col" }, "read by the firmware, sensors' own axes")));
    const setting = (id: string, name: string, unit: string, step: string, entry: (value: number) => Entry): HTMLElement => {
      const input = el("input", {
        type: "number", step, id: `set-${id}`,
        change: () => { if (input.value !== "") act(entry(Number(input.value))); },
      });
      this.figures[`set-${id}`] = input;
      return el("label", { class: "setting" }, el("span", {}, name), input, el("span", { class: "unit" }, unit));
    };
    const field = ["north", "east", "down"].map((name) => el("input", { type: "number", step: "0.5", "aria-label": `Earth's field ${name}, microtesla`, title: `${name}, µT` }));
    field.forEach((input, index) => (input.value = ["21.5", "0", "43"][index] ?? "0"));
    const setField = (): void => {
      const [north_ut = 0, east_ut = 0, down_ut = 0] = field.map((input) => Number(input.value));
      act({ do: "set_field", field: { north_ut, east_ut, down_ut } });
    };
    field.forEach((input) => input.addEventListener("change", setField));
    this.earth.append(el("span", { title: "North, east and down, without the fields of iron, magnets and motors" }, "Earth's field"), ...field, el("span", { class: "unit" }, "µT N E D"));
    const figure = (id: string, name: string): HTMLElement => {
      const value = el("dd", { id: `fig-${id}` });
      this.figures[id] = value;
      return el("div", {}, el("dt", {}, name), value);
    };
    this.element.append(table, this.read,
      el("h3", {}, "Surroundings"),
      el("div", { class: "settings" },
        setting("altitude", "Height", "m", "0.1", (metres) => ({ do: "follow_altitude", metres, time_constant: "300ms" })),
        setting("pressure", "Pressure", "hPa", "0.1", (pressure_hpa) => ({ do: "set_pressure", pressure_hpa })),
        setting("temperature", "Temperature", "°C", "0.5", (temperature_degc) => ({ do: "set_temperature", temperature_degc })),
        setting("humidity", "Humidity", "%", "1", (humidity_percent) => ({ do: "set_humidity", humidity_percent })),
        this.earth),
      el("h3", {}, "Timing"),
      el("div", { class: "callback", title: "Time in the callback of each period" }, el("span", { class: "bar" }, this.bar), (this.figures["callback"] = el("span", { id: "fig-callback" }))),
      el("dl", { class: "figures" }, figure("rate", "Timer"), figure("ticks", "Ticks"), figure("late", "Late, lost"), figure("wait", "Longest wait"), figure("bus", "Sensor bus"), figure("serial", "Serial line")),
      el("h3", {}, "Other access"), this.ways);
  }

  // What the board's sensors measure: a row for each quantity, and of the surroundings what a sensor feels.
  declare(outputs: Output[]): void {
    this.outputs = outputs;
    const felt = (quantity: string): boolean => outputs.some((one) => one.quantity === quantity);
    this.read.replaceChildren(...outputs.map(({ id, part, unit, axes, doc }, index) => {
      const cells = Array.from({ length: axes }, () => el("td", {}, "–"));
      this.rows[id] = cells;
      const name = outputs[index - 1]?.part === part ? "" : part;
      const beside = name === "" && axes === 1; // such as a thermometer, which most programs do not read
      return el("tr", { "data-output": id, title: doc, hidden: beside }, name ? el("th", { scope: "row" }, name) : el("td"), ...cells, ...(axes > 1 ? [] : [el("td", {}), el("td", {})]), el("td", { class: "unit" }, unit));
    }));
    const shown: [string, boolean][] = [
      ["pressure", felt("pressure_hpa")], ["temperature", felt("temperature_degc")], ["humidity", felt("relative_humidity_percent")],
    ];
    for (const [id, there] of shown) {
      const label = this.figures[`set-${id}`]?.parentElement;
      if (label) label.hidden = !there;
    }
    this.earth.hidden = !felt("magnetic_field_mgauss");
  }

  show({ truth, samples, load }: State): void {
    this.put("attitude", [truth.roll_deg, truth.pitch_deg, truth.yaw_deg], 1);
    this.put("rate", truth.rate_dps, 1);
    this.put("acc", truth.acc_mg, 0);
    this.put("mag", truth.mag_mgauss, 0);
    for (const { id, axes } of this.outputs) {
      this.put(id, samples[id], axes > 1 ? 0 : 2);
      const row = this.rows[id]?.[0]?.parentElement;
      if (row && id in samples) row.hidden = false;
    }
    this.set("altitude", truth.altitude_m, 2);
    this.set("pressure", truth.pressure_hpa, 2);
    this.set("temperature", truth.temperature_degc, 1);
    this.set("humidity", truth.humidity_percent, 0);
    const of = (name: string): number => load[name] ?? 0;
    const share = of("callback_share");
    this.bar.style.width = `${Math.min(100, 100 * share)}%`;
    this.bar.classList.toggle("full", share > 0.97);
    const known = of("callback_ms") > 0;
    this.say("callback", known ? `callback ${fixed(of("callback_ms"), 2)} of ${fixed(of("period_ms"), 2)} ms, ${fixed(100 * share, 0)} %` : "callback: not measured (built firmware only)");
    this.say("rate", of("rate_hz") ? `${fixed(of("rate_hz"), 1)} Hz` : "stopped");
    this.say("ticks", String(of("ticks")));
    this.say("late", `${of("late")}, ${of("lost")}`);
    this.say("wait", `${fixed(of("longest_wait_ms"), 3)} ms`);
    const hertz = of("bus_hz");
    this.say("bus", hertz ? `${of("bus_is_i2c") ? "I2C" : "SPI"} ${hertz >= 1e6 ? `${fixed(hertz / 1e6, 3)} MHz` : `${fixed(hertz / 1e3, 0)} kHz`}` : "not used");
    this.say("serial", `${of("baud")} baud, ${fixed(100 * of("line_share"), 1)} % busy`);
  }

  tellWays(lines: string[]): void {
    const ways = [...lines, "fcu move --roll 30, fcu terminal: in another terminal"];
    if (!lines.some((line) => !line.startsWith("gdb:"))) ways.push("serial port: start with fcu web FIRMWARE --serial port (or tcp)");
    if (!lines.some((line) => line.startsWith("gdb:"))) ways.push("debugger: start with fcu web FIRMWARE --gdb 3333");
    this.ways.replaceChildren(...ways.map((line) => el("li", {}, line)));
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
