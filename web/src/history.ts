// Values received for the plot, at most the last ten minutes, so that memory use is bounded.

import type { Past, Plotted, Printed } from "./protocol";

const KEPT = 30_000; // states, ten minutes at 50 a second
const KEPT_PRINTS = 6_000;

export class Table {
  readonly t: number[] = [];
  readonly columns = new Map<string, (number | null)[]>();
  constructor(private readonly most: number) {}

  add(t: number, values: Record<string, number>): void {
    const before = this.t.at(-1);
    if (before !== undefined && t < before) this.clear(); // time has begun anew
    if (t === before) { // lines that were printed together
      const last = this.t.length - 1;
      for (const [name, value] of Object.entries(values)) {
        const column = this.columns.get(name) ?? new Array<null>(this.t.length).fill(null);
        column[last] = value;
        this.columns.set(name, column);
      }
      return;
    }
    for (const name of Object.keys(values)) {
      if (!this.columns.has(name)) this.columns.set(name, new Array<null>(this.t.length).fill(null));
    }
    this.t.push(t);
    for (const [name, column] of this.columns) column.push(values[name] ?? null);
    if (this.t.length > this.most * 1.1) {
      const old = this.t.length - this.most;
      this.t.splice(0, old);
      for (const column of this.columns.values()) column.splice(0, old);
    }
  }

  clear(): void {
    this.t.length = 0;
    this.columns.clear();
  }

  // Times and columns between two times; an unknown column is empty.
  slice(from: number, to: number, names: string[]): (number | null)[][] {
    let low = lower(this.t, from), high = lower(this.t, to);
    low = Math.max(0, low - 1);
    high = Math.min(this.t.length, high + 1);
    const empty = new Array<null>(high - low).fill(null);
    return [this.t.slice(low, high), ...names.map((name) => this.columns.get(name)?.slice(low, high) ?? empty)];
  }
}

function lower(sorted: number[], value: number): number {
  let low = 0, high = sorted.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((sorted[middle] ?? 0) < value) low = middle + 1;
    else high = middle;
  }
  return low;
}

const XYZ = ["x", "y", "z"];

export class History {
  readonly states = new Table(KEPT);
  readonly prints = new Table(KEPT_PRINTS);

  clear(): void {
    this.states.clear();
    this.prints.clear();
  }

  // Replaces the received values by the session's record, which has no gaps.
  replace({ states, prints }: Past): void {
    this.clear();
    for (const state of states) this.addState(state);
    for (const printed of prints) this.addPrinted(printed);
  }

  addState(state: Plotted): void {
    const { truth } = state;
    const values: Record<string, number> = {
      "truth.Roll": truth.roll_deg, "truth.Pitch": truth.pitch_deg, "truth.Yaw": truth.yaw_deg,
      "truth.Altitude": truth.altitude_m, "truth.Pre": truth.pressure_hpa, "truth.Temp": truth.temperature_degc,
      "truth.Hum": truth.humidity_percent,
    };
    XYZ.forEach((axis, index) => {
      values[`truth.ACC.${axis}`] = truth.acc_mg[index] ?? 0;
      values[`truth.GYR.${axis}`] = 1000 * (truth.rate_dps[index] ?? 0);
      values[`truth.MAG.${axis}`] = truth.mag_mgauss[index] ?? 0;
    });
    for (const [name, sample] of Object.entries(state.samples)) {
      sample.forEach((value, index) => (values[sample.length > 1 ? `raw.${name}.${XYZ[index]}` : `raw.${name}`] = value));
    }
    for (const [name, value] of Object.entries(state.variables)) values[`var.${name}`] = value;
    this.states.add(state.t_s, values);
  }

  addPrinted(printed: Pick<Printed, "t_s" | "values">): void {
    this.prints.add(printed.t_s, Object.fromEntries(Object.entries(printed.values).map(([name, value]) => [`print.${name}`, value])));
  }
}
