// Registers of the sensors and of the chip's peripherals, decoded with declarations from the session.

import { el, setText } from "./dom";
import type { Field, Part, Registers } from "./protocol";
import { TabRow } from "./tabs";

export class RegisterView {
  readonly element = el("div", { class: "registers" });
  part = "";
  onPart: () => void = () => undefined;
  private readonly choice = new TabRow("Sensor", (name) => this.choose(name));
  private readonly peripherals = el("select", { id: "peripheral", "aria-label": "Peripheral of the chip", hidden: true, change: () => this.peripherals.value && this.choose(this.peripherals.value) });
  private readonly body = el("tbody");
  private readonly place = el("p", { class: "hint" });
  private readonly changedOnly: HTMLInputElement;
  private names: string[] = [];
  private declared: Part | null = null;
  private before: Record<string, string> = {};
  private rows: { row: HTMLTableRowElement; value: HTMLElement; fields: { field: Field; cell: HTMLElement }[] }[] = [];

  constructor() {
    this.changedOnly = el("input", { type: "checkbox", checked: true, change: () => this.hide() });
    this.element.append(el("div", { class: "row" }, this.choice.element, this.peripherals),
      el("div", { class: "row" }, this.place, el("label", { class: "check" }, this.changedOnly, " only those written by the firmware")),
      el("table", { class: "register-table" }, this.body));
  }

  // Names of the sensors and of the chip's peripherals; firmware in Python has no peripherals.
  offer(parts: string[]): void {
    this.names = parts;
    this.choice.offer(parts.map((name) => ({ id: name, name, attributes: { "data-part": name } })));
    this.choose(this.part || (parts[0] ?? ""));
  }

  offerPeripherals(peripherals: string[]): void {
    if (peripherals.join() !== [...this.peripherals.options].slice(1).map((one) => one.value).join()) {
      this.peripherals.replaceChildren(el("option", { value: "" }, "chip…"), ...peripherals.map((name) => el("option", { value: name }, name)));
    }
    this.peripherals.hidden = !peripherals.length;
    if (!this.names.includes(this.part) && !peripherals.includes(this.part)) this.choose(this.names[0] ?? "");
    this.peripherals.value = peripherals.includes(this.part) ? this.part : "";
  }

  private choose(name: string): void {
    this.part = name;
    this.peripherals.value = this.names.includes(name) ? "" : name;
    this.peripherals.classList.toggle("chosen", !this.names.includes(name));
    this.choice.select(name);
    this.onPart();
  }

  // Stores a part's declarations, which the session sends before the part's first values.
  declare(part: Part): void {
    if (part.name !== this.part || part.name === this.declared?.name) return;
    this.declared = part;
    this.before = {};
    const digits = Math.max(2, (part.registers.at(-1)?.address ?? 0).toString(16).length);
    this.rows = part.registers.map((register) => {
      const value = el("td", { class: "value" });
      const fields = register.fields.map((field) => ({ field, cell: el("span", { class: "field", title: `${field.name}${field.doc ? `: ${field.doc}` : ""}` }) }));
      const row = el("tr", { "data-register": register.name, title: register.doc },
        el("td", { class: "address" }, register.address.toString(16).padStart(digits, "0").toUpperCase()),
        el("th", { scope: "row" }, register.name), value, el("td", {}, ...fields.map((one) => one.cell)));
      return { row, value, fields };
    });
    this.body.replaceChildren(...this.rows.map((one) => one.row));
  }

  show({ part, values, note }: Registers): void {
    const { declared } = this;
    if (part !== this.part || declared?.name !== part) return;
    setText(this.place, note || declared.place);
    this.place.classList.toggle("warning", note !== "");
    declared.registers.forEach((register, index) => {
      const shown = this.rows[index];
      if (!shown) return;
      const digits = values[register.name] ?? "0", now = Number.parseInt(digits, 16);
      const then = Number.parseInt(this.before[register.name] ?? digits, 16);
      setText(shown.value, digits);
      shown.row.dataset["reset"] = String(now === register.reset);
      flash(shown.value, now !== then);
      for (const { field, cell } of shown.fields) {
        const value = bitsOf(now, field);
        setText(cell, field.msb === field.lsb ? field.name : `${field.name} ${value}`);
        cell.classList.toggle("off", value === 0);
        flash(cell, value !== bitsOf(then, field));
      }
    });
    this.before = values;
    this.hide();
  }

  private hide(): void {
    for (const { row } of this.rows) row.hidden = this.changedOnly.checked && row.dataset["reset"] !== "false";
  }
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
