// Help: the keyboard shortcuts in a dialog, and a short tour of the page.

import { button, el, setText } from "./dom";

export interface Shortcut { keys: string; text: string }

export class KeyDialog {
  readonly element: HTMLDialogElement;

  constructor(groups: [string, Shortcut[]][], tour: () => void) {
    this.element = el("dialog", { id: "keys", "aria-labelledby": "keys-title" },
      el("h2", { id: "keys-title" }, "Keys"),
      ...groups.map(([title, shortcuts]) => el("section", {}, el("h3", {}, title),
        el("dl", {}, ...shortcuts.map(({ keys, text }) => el("div", {}, el("dt", {}, ...keys.split(" ").map((key) => el("kbd", {}, key))), el("dd", {}, text)))))),
      el("div", { class: "row" },
        button("Tour", "Show the parts of the page one by one", () => { this.element.close(); tour(); }, { id: "tour-again" }),
        button("Close", "Close (Escape)", () => this.element.close(), { class: "primary", autofocus: "" })));
  }

  open(): void {
    if (!this.element.open) this.element.showModal();
  }
}

interface Stop { at: string; title: string; text: string }

const STOPS: Stop[] = [
  { at: ".view", title: "The board", text: "Drag the board to turn it; its sensors measure the motion. The wheel lifts it. Sliders and gestures are below." },
  { at: ".exercise", title: "The exercise", text: "Choose an exercise and read its question. Check tests your program while the board keeps running." },
  { at: ".plot", title: "The plot", text: "Dashed lines are the true values, dots the printed ones. Add a global variable to plot it, too." },
  { at: ".serial", title: "The terminal", text: "Output of your program on USART1. Click here to type to the board." },
  { at: "#inside", title: "Inside", text: "The world in numbers, registers, bus transfers, pins, scenarios, and the diagnosis of problems." },
  { at: ".bar", title: "The run", text: "Pause, step, change the speed. A changed firmware file is loaded again. Press ? for all keys." },
];
const TAKEN = "fcu-tour";

export class Tour {
  readonly element: HTMLElement;
  private readonly count = el("span", { class: "hint" });
  private readonly title = el("h2", { id: "tour-title" });
  private readonly text = el("p", { id: "tour-text" });
  private readonly back: HTMLButtonElement;
  private readonly forth: HTMLButtonElement;
  private stops: Stop[] = [];
  private at = 0;

  constructor() {
    this.back = button("Back", "Previous part", () => this.show(this.at - 1));
    this.forth = button("Next", "Next part", () => this.show(this.at + 1), { class: "primary", id: "tour-next" });
    this.element = el("section", { class: "tour", role: "dialog", "aria-labelledby": "tour-title", "aria-describedby": "tour-text", hidden: true, id: "tour",
      keydown: (event: KeyboardEvent) => { if (event.key === "Escape") this.end(); } },
      this.title, this.text, el("div", { class: "row" }, this.count, button("Skip", "End the tour (Escape)", () => this.end(), { id: "tour-skip" }), this.back, this.forth));
    window.addEventListener("resize", () => this.place());
  }

  startOnFirstVisit(): void {
    if (localStorage.getItem(TAKEN) === null) this.start();
  }

  start(): void {
    this.stops = STOPS.filter(({ at }) => document.querySelector<HTMLElement>(at)?.offsetParent);
    this.element.hidden = false;
    this.show(0);
    this.forth.focus();
  }

  private end(): void {
    localStorage.setItem(TAKEN, "taken");
    this.element.hidden = true;
    document.querySelector(".toured")?.classList.remove("toured");
  }

  private show(index: number): void {
    const stop = this.stops[index];
    if (!stop) return this.end();
    this.at = index;
    setText(this.title, stop.title);
    setText(this.text, stop.text);
    setText(this.count, `${index + 1} of ${this.stops.length}`);
    setText(this.forth, index === this.stops.length - 1 ? "Done" : "Next");
    this.back.hidden = index === 0;
    document.querySelector(".toured")?.classList.remove("toured");
    const target = document.querySelector(stop.at);
    target?.classList.add("toured");
    target?.scrollIntoView({ block: "nearest" });
    this.place();
  }

  // Beside the part where there is room, else over its lower end.
  private place(): void {
    const target = document.querySelector(".toured");
    if (!target || this.element.hidden) return;
    const { left, right, top, bottom } = target.getBoundingClientRect();
    const { offsetWidth: width, offsetHeight: height } = this.element;
    const gap = 12, limit = (value: number, most: number): number => Math.max(gap, Math.min(value, most - gap));
    const beside = right + gap + width < innerWidth ? right + gap : left - gap - width;
    const x = beside >= gap ? beside : left + (right - left - width) / 2;
    const below = bottom + gap + height < innerHeight ? bottom + gap : bottom - height - gap;
    const y = beside >= gap ? top + gap : below;
    this.element.style.left = `${limit(x, innerWidth - width)}px`;
    this.element.style.top = `${limit(y, innerHeight - height)}px`;
  }
}
