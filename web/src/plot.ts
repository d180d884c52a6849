// The plot: truth, what the firmware reads, what it prints, and its variables, over virtual time.

import uPlot from "uplot";
import { button, colour, download, el, setText } from "./dom";
import type { History } from "./history";
import type { Output } from "./protocol";
import { TabRow } from "./tabs";
import { tints, type Tinted } from "./tints";

interface Channel extends Tinted { id: string; name: string; wraps?: boolean }
interface Subject { id: string; name: string; unit: string; channels: Channel[]; quantity?: string }

const AXES = ["x", "y", "z"] as const;
const MOST_WATCHED = 16;
const HALF_TURN = 180; // degrees: an angle that changes by more between two points has wrapped

function vector(id: string, name: string, unit: string, quantity: string): Subject {
  return {
    id, name, unit, quantity,
    channels: AXES.flatMap((family): Channel[] => [
      { id: `truth.${id}.${family}`, name: `${family} truth`, family, kind: "truth" },
      { id: `print.${id}.${family}`, name: `${family} printed`, family, kind: "print" },
    ]),
  };
}

function scalar(id: string, name: string, unit: string, quantity = ""): Subject {
  return {
    id, name, unit, quantity,
    channels: [
      { id: `truth.${id}`, name: "truth", family: "", kind: "truth" },
      { id: `print.${id}`, name: "printed", family: "", kind: "print" },
    ],
  };
}

// Channels that the firmware reads for one quantity, from all sensors that measure it.
function readings(outputs: Output[]): Channel[] {
  return outputs.flatMap((one): Channel[] => {
    const whose = outputs.length > 1 ? `${one.part} ` : "";
    if (one.axes > 1) return AXES.map((family) => ({ id: `raw.${one.id}.${family}`, name: `${family} ${whose}read`, family, kind: "raw" }));
    return [{ id: `raw.${one.id}`, name: `${whose}read`, family: "", kind: "raw" }];
  });
}

const ANGLES: Subject = {
  id: "angles", name: "Angles", unit: "deg",
  channels: ([["Roll", "x", false], ["Pitch", "y", false], ["Yaw", "z", true]] as const).flatMap(([name, family, wraps]): Channel[] => [
    { id: `truth.${name}`, name: `${name} truth`, family, kind: "truth", wraps },
    { id: `print.${name}`, name: `${name} printed`, family, kind: "print", wraps },
  ]),
};
const QUANTITIES: Subject[] = [
  vector("ACC", "Acc", "mg", "acceleration_g"), vector("GYR", "Gyro", "mdps", "angular_rate_dps"),
  vector("MAG", "Mag", "mG", "magnetic_field_mgauss"), scalar("Pre", "Pressure", "hPa", "pressure_hpa"),
  scalar("Hum", "Humidity", "%", "relative_humidity_percent"), scalar("Temp", "Temp", "°C", "temperature_degc"),
];
const HEIGHT = scalar("Altitude", "Height", "m");
const VARIABLES: Subject = { id: "variables", name: "Variables", unit: "", channels: [] };

// Subjects that can be plotted for a board with these sensors; other measured quantities get a subject each.
function subjects(outputs: Output[]): Subject[] {
  const known = QUANTITIES.map((one) => one.quantity);
  const others = [...new Set(outputs.filter((one) => !known.includes(one.quantity)).map((one) => one.quantity))].map((quantity): Subject => {
    const { doc = quantity, unit = "" } = outputs.find((one) => one.quantity === quantity) ?? {};
    return { id: quantity, name: doc, unit, quantity, channels: [] };
  });
  const measured = [...QUANTITIES, ...others].flatMap((subject) => {
    const own = outputs.filter((one) => one.quantity === subject.quantity);
    return own.length ? [{ ...subject, channels: [...subject.channels, ...readings(own)] }] : [];
  });
  return [ANGLES, ...measured, HEIGHT, VARIABLES];
}

export class Plot {
  readonly element: HTMLElement;
  watched: string[] = [];
  onWatch: (names: string[]) => void = () => undefined;
  private readonly area = el("div", { class: "area", id: "plot-area", role: "tabpanel", "aria-label": "Plot over virtual time", tabindex: "0" });
  private readonly names = el("datalist", { id: "variable-names" });
  private readonly chips = el("span", { class: "chips" });
  private readonly freezer: HTMLButtonElement;
  private readonly tabs = new TabRow("Quantity", (id) => this.chooseById(id), "plot-area");
  private readonly add: HTMLInputElement;
  private readonly adding: HTMLElement;
  private offered: Subject[] = [];
  private subject: Subject = ANGLES;
  private window = 20;
  private frozenAt: number | null = null;
  private chart: uPlot | null = null;
  private shownIds = "";
  private pending = false;
  private zoomed = false;
  private size = "";

  constructor(private readonly history: History) {
    this.freezer = button("Freeze", "Stop the plot; the board keeps running", () => this.freeze(this.frozenAt === null));
    this.add = el("input", {
      type: "text", list: "variable-names", placeholder: "Add a variable", title: "A global variable of the program, such as pitch or acc.AXIS_X", "aria-label": "Add a variable", class: "short", spellcheck: "false",
      change: () => {
        const name = this.add.value.trim();
        if (name && !this.watched.includes(name) && this.watched.length < MOST_WATCHED) this.watch([...this.watched, name]);
        this.add.value = "";
      },
    });
    this.adding = el("div", { class: "adding" }, this.add, this.names, this.chips);
    const span = el("select", { "aria-label": "Seconds shown", change: () => { this.window = Number(span.value); this.freeze(false); } },
      ...[5, 20, 60, 300].map((seconds) => el("option", { value: String(seconds), selected: seconds === this.window }, `${seconds} s`)));
    this.element = el("section", { class: "panel plot", "aria-label": "Plot" },
      el("header", {}, el("h2", {}, "Plot"), this.tabs.element, el("span", { class: "gap" }), span, this.freezer,
        button("CSV", "Save the shown values as CSV", () => this.saveCsv()), button("PNG", "Save the plot as a picture", () => this.savePng())),
      this.adding, this.area);
    this.adding.hidden = true;
    this.watch((kept("fcu-watched") ?? "").split("\n").filter(Boolean));
  }

  declare(outputs: Output[]): void {
    this.offered = subjects(outputs);
    this.tabs.offer(this.offered.map(({ id, name }) => ({ id, name, attributes: { "data-subject": id } })));
    this.chooseById(kept("fcu-subject") ?? this.subject.id);
  }

  private chooseById(id: string): void {
    this.choose(this.offered.find((one) => one.id === id) ?? ANGLES);
    keep("fcu-subject", this.subject.id);
  }

  private choose(subject: Subject): void {
    this.subject = subject;
    this.tabs.select(subject.id);
    this.adding.hidden = subject.id !== "variables";
    this.rebuild();
  }

  offer(names: string[]): void {
    this.names.replaceChildren(...names.map((name) => el("option", { value: name })));
  }

  private watch(names: string[]): void {
    this.watched = names;
    keep("fcu-watched", names.join("\n"));
    this.chips.replaceChildren(...names.map((name) => button(`${name} ×`, `Remove ${name}`, () => this.watch(this.watched.filter((one) => one !== name)))));
    this.onWatch(names);
    this.refresh();
  }

  // Removes variables that the session does not know; the input field shows the first one for correction.
  refuse(names: string[]): void {
    this.watch(this.watched.filter((one) => !names.includes(one)));
    this.add.value = names[0] ?? "";
  }

  freeze(on: boolean): void {
    this.frozenAt = on ? (this.history.states.t.at(-1) ?? 0) : null;
    this.zoomed = false;
    setText(this.freezer, on ? "Follow" : "Freeze");
    this.freezer.setAttribute("aria-pressed", String(on));
    this.refresh();
  }

  resize(): void {
    const { clientWidth: width, clientHeight: height } = this.area;
    if (!width || !height) return;
    this.size = `${width} ${height}`;
    if (!this.chart) this.rebuild();
    const legend = this.chart?.root.querySelector(".u-legend");
    this.chart?.setSize({ width, height: Math.max(80, height - (legend?.clientHeight ?? 0)) });
  }

  restyle(): void {
    this.rebuild();
  }

  // Redraws the plot at most once per frame, and not while it is frozen.
  refresh(): void {
    if (this.pending) return;
    this.pending = true;
    window.setTimeout(() => requestAnimationFrame(() => {
      this.pending = false;
      this.draw();
    }), 40);
  }

  private channels(): Channel[] {
    if (this.subject.id === "variables") {
      const known = [...this.history.states.columns.keys()].filter((id) => id.startsWith("var."));
      const wanted = known.filter((id) => this.watched.some((name) => id === `var.${name}` || id.startsWith(`var.${name}.`) || id.startsWith(`var.${name}[`)));
      return wanted.map((id) => ({ id, name: id.slice(4), family: "", kind: "var", wraps: /(^|[._])(yaw|heading)$/i.test(id.slice(4)) }));
    }
    const { states, prints } = this.history;
    return this.subject.channels.filter(({ id, kind }) => kind === "truth" || (kind === "print" ? prints : states).columns.has(id));
  }

  private data(channels: Channel[], from: number, to: number): uPlot.AlignedData {
    const prints = channels.filter((one) => one.kind === "print"), others = channels.filter((one) => one.kind !== "print");
    const left = this.history.states.slice(from, to, others.map((one) => one.id));
    const right = this.history.prints.slice(from, to, prints.map((one) => one.id));
    const nulls = [left, right].map((table) => table.map(() => 2)); // a gap in one table is no gap of the other's lines
    const joined = uPlot.join([left as uPlot.AlignedData, right as uPlot.AlignedData], nulls);
    const order = [...others, ...prints];
    return [joined[0], ...channels.map((one) => joined[1 + order.indexOf(one)] ?? [])] as uPlot.AlignedData;
  }

  private draw(): void {
    if (this.size !== `${this.area.clientWidth} ${this.area.clientHeight}`) this.resize();
    const channels = this.channels();
    if (!this.chart || channels.map((one) => one.id).join() !== this.shownIds) {
      this.rebuild();
      return;
    }
    if (this.zoomed) return;
    const end = this.frozenAt ?? this.history.states.t.at(-1) ?? 0;
    this.chart.setData(this.data(channels, end - this.window, end), false);
    this.chart.setScale("x", { min: Math.max(0, end - this.window), max: Math.max(end, this.window) });
  }

  private rebuild(): void {
    const { clientWidth: width, clientHeight: height } = this.area;
    if (!width || !height) return;
    this.chart?.destroy();
    const channels = this.channels();
    this.shownIds = channels.map((one) => one.id).join();
    const ink = colour("--muted"), grid = { stroke: colour("--grid"), width: 1 };
    const font = "11px system-ui, sans-serif";
    const { unit } = this.subject;
    const tinted = tints(channels, document.documentElement.dataset["theme"] === "dark");
    // An angle that wraps has a separate axis at the right, because its jumps would flatten the other lines.
    const turns = channels.some((one) => one.wraps), others = channels.some((one) => !one.wraps);
    const scaleOf = (one: Channel): string => (one.wraps && others ? "turn" : "y");
    const range: uPlot.Scale.Range = (_chart, low, high) => around(low, high);
    const right: uPlot.Axis[] = turns && others ? [{ scale: "turn", side: 1, stroke: ink, grid: { show: false }, ticks: grid, font, size: 50, label: `${names(channels)}${unit ? ` ${unit}` : ""}`, labelFont: font, labelSize: 14 }] : [];
    this.chart = new uPlot({
      width, height: Math.max(80, height - 30),
      scales: { x: { time: false }, y: { range }, ...(right.length ? { turn: { range } } : {}) },
      cursor: { drag: { x: true, y: false }, points: { size: 6 } },
      legend: { live: true, markers: { dash: (_chart, index) => (channels[index - 1]?.kind === "truth" ? "dashed" : "solid") } },
      hooks: {
        setSelect: [(chart) => {
          if (chart.select.width < 5) return;
          if (this.frozenAt === null) this.freeze(true);
          this.zoomed = true;
        }],
        ready: [(chart) => chart.over.addEventListener("dblclick", () => this.freeze(false))],
      },
      axes: [
        { stroke: ink, grid, ticks: grid, font, size: 28, values: (_chart, ticks) => ticks.map((one) => `${one} s`) },
        { stroke: ink, grid, ticks: grid, font, size: 56, label: unit, labelFont: font, labelSize: 14 },
        ...right,
      ],
      series: [
        { label: "t", value: (_chart, value) => (value === null ? "–" : `${value.toFixed(3)} s`) },
        ...channels.map((one, index): uPlot.Series => ({
          label: one.name, stroke: tinted[index] ?? ink, scale: scaleOf(one), spanGaps: false, gaps: one.wraps || this.subject === ANGLES ? wraps : () => [],
          width: one.kind === "truth" ? 1 : 1.6, dash: one.kind === "truth" ? [5, 4] : [],
          points: { show: one.kind === "print", size: 5, fill: tinted[index] ?? ink },
          value: (_chart: uPlot, value: number | null) => (value === null ? "–" : `${value.toFixed(2)}${unit ? ` ${unit}` : ""}`),
        })),
      ],
    }, this.data(channels, -1, 0), this.area);
    const legend = this.chart.root.querySelector(".u-legend");
    this.chart.setSize({ width, height: Math.max(80, height - (legend?.clientHeight ?? 0)) });
    this.zoomed = false;
    this.draw();
  }

  private saveCsv(): void {
    const channels = this.channels();
    const { min = 0, max = 0 } = this.chart?.scales["x"] ?? {};
    const [times = [], ...columns] = this.data(channels, min, max);
    const unit = this.subject.unit ? ` (${this.subject.unit})` : "";
    const quoted = (text: string): string => `"${text.replaceAll('"', '""')}"`;
    const lines = [["t_s", ...channels.map((one) => quoted(`${one.name}${unit}`))].join(",")];
    times.forEach((t, row) => {
      if (t >= min && t <= max) lines.push([t, ...columns.map((column) => column[row] ?? "")].join(","));
    });
    download(`${this.subject.id}.csv`, new Blob([lines.join("\n") + "\n"], { type: "text/csv" }));
  }

  private savePng(): void {
    const source = this.chart?.ctx.canvas;
    if (!source) return;
    const canvas = el("canvas", { width: String(source.width), height: String(source.height) });
    const context = canvas.getContext("2d");
    if (!context) return;
    context.fillStyle = colour("--surface");
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.drawImage(source, 0, 0);
    canvas.toBlob((blob) => blob && download(`${this.subject.id}.png`, blob));
  }
}

// Names of the quantities that wrap, without duplicates, for example "Yaw".
function names(channels: Channel[]): string {
  return [...new Set(channels.filter((one) => one.wraps).map((one) => one.name.split(" ")[0]))].join(", ");
}

// Gaps of an angle's line, at the points where it wraps. Missing values between two points are not a gap.
function wraps(chart: uPlot, index: number, from: number, to: number): uPlot.Series.Gaps {
  const times = chart.data[0], values = chart.data[index] ?? [];
  const gaps: uPlot.Series.Gaps = [];
  const at = (one: number): number => chart.valToPos(times[one] ?? 0, "x", true);
  let before = -1;
  for (let now = from; now <= to; now++) {
    const value = values[now];
    if (value === null || value === undefined) continue;
    if (before >= 0 && Math.abs(value - (values[before] ?? value)) > HALF_TURN) gaps.push([at(before), at(now)]);
    before = now;
  }
  return gaps;
}

// Settings that survive a reload of the page in this tab.
function kept(name: string): string | null {
  return sessionStorage.getItem(name);
}

function keep(name: string, value: string): void {
  sessionStorage.setItem(name, value);
}

// Range of an axis: visible values with a margin, and a minimum height, so that noise is not magnified.
function around(low: number | null, high: number | null): [number, number] {
  if (low === null || high === null || !Number.isFinite(low)) return [-1, 1];
  const least = Math.max(1e-6, Math.abs(high + low) * 0.0005, 0.02);
  const margin = Math.max((high - low) * 0.08, least);
  return [low - margin, high + margin];
}
