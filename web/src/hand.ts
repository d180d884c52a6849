// The hand: dragging, keys, sliders and gestures, all of them timeline entries. A target is sent at most 40 times a
// second; the world follows it continuously in rate and acceleration.

import { button, el, fixed, setText } from "./dom";
import type { BoardPicture } from "./board3d";
import type { Shortcut } from "./help";
import type { Entry, Gesture, Place, Truth } from "./protocol";
import { about, multiply, toAngles, toMatrix, type Angles, type Matrix } from "./rotation";

const SEND_EVERY_MS = 25;
const HELD_MS = 400; // after the last move the sliders follow the board again
const DEGREES_PER_PIXEL = 0.45;
const FIRST_PLACE: Place = [0.2, 0, 0]; // of a magnet that is held near the board
const NEAREST_M = 0.03, FARTHEST_M = 0.3; // where it is dragged to

export const HAND_KEYS: Shortcut[] = [
  { keys: "↑ ↓", text: "tilt about the board's X axis" },
  { keys: "← →", text: "tilt about the board's Y axis" },
  { keys: "Q E", text: "turn about the vertical" },
  { keys: "PageUp PageDown", text: "lift and lower by 10 cm" },
  { keys: "0", text: "lay the board flat" },
  { keys: "Shift", text: "with arrows, Q and E: 1 degree instead of 5; while dragging: roll about the line of sight" },
];
export const MAGNET_KEYS: Shortcut[] = [
  { keys: "← → ↑ ↓", text: "move the magnet north, south, west and east by 1 cm" },
  { keys: "PageUp PageDown", text: "move the magnet up and down by 1 cm" },
  { keys: "Shift", text: "5 cm instead of 1" },
];

interface Slider { input: HTMLInputElement; output: HTMLOutputElement; digits: number; unit: string }

export class Hand {
  readonly controls: HTMLElement;
  private target: Matrix = toMatrix({ roll: 0, pitch: 0, yaw: 0 });
  private metres = 0;
  private movedAt = 0;
  private timer = 0;
  private turned = false;
  private lifted = false;
  private led = false;
  private magnet: Place | null = null;
  private readonly holder = button("Hold", "Hold a magnet near the board or take it away; drag it, or use the arrow keys, Page Up and Page Down", () => this.toggleMagnet(), { id: "magnet", "aria-pressed": "false" });
  private readonly place = el("output", { for: "magnet", id: "magnet-place" });
  private readonly gestures = el("div", { class: "gestures", role: "group", "aria-label": "Gestures" });
  private readonly sliders: Record<string, Slider> = {};

  constructor(private readonly picture: BoardPicture, private readonly act: (entry: Entry) => void) {
    this.controls = this.build();
    this.grab();
  }

  follow(truth: Truth): void {
    if (performance.now() - this.movedAt < HELD_MS) return;
    this.target = truth.rotation;
    this.metres = truth.altitude_m;
    this.showAngles({ roll: truth.roll_deg, pitch: truth.pitch_deg, yaw: truth.yaw_deg });
    this.showSlider("height", truth.altitude_m);
    this.showMagnet(truth.magnet_m);
  }

  private turnTo(target: Matrix): void {
    this.target = target;
    this.turned = true;
    this.showAngles(toAngles(target));
    this.moved();
  }

  private turnBy(axis: [number, number, number], degrees: number, inBoard = false): void {
    const turn = about(axis, degrees);
    this.turnTo(inBoard ? multiply(this.target, turn) : multiply(turn, this.target));
  }

  private liftTo(metres: number): void {
    this.metres = Math.min(Math.max(metres, -1), 10);
    this.lifted = true;
    this.showSlider("height", this.metres);
    this.moved();
  }

  private moved(): void {
    this.movedAt = performance.now();
    if (!this.timer) {
      this.send();
      this.timer = window.setTimeout(() => {
        this.timer = 0;
        if (this.turned || this.lifted || this.led) this.moved();
      }, SEND_EVERY_MS);
    }
  }

  private send(): void {
    if (this.turned) {
      const { roll, pitch, yaw } = toAngles(this.target);
      const short = (value: number): number => Number(fixed(value, 2));
      this.act({ do: "follow_attitude", roll_deg: short(roll), pitch_deg: short(pitch), yaw_deg: short(yaw) });
    }
    if (this.lifted) this.act({ do: "follow_altitude", metres: Number(fixed(this.metres, 3)), time_constant: "300ms" });
    if (this.led && this.magnet) {
      const [north_m, west_m, up_m] = this.magnet.map((one) => Number(fixed(one, 3)));
      this.act({ do: "follow_magnet", north_m, west_m, up_m });
    }
    this.turned = this.lifted = this.led = false;
  }

  private leadMagnet([north, west, up]: Place): void {
    const distance = Math.hypot(north, west, up);
    if (distance < NEAREST_M) return;
    const scale = Math.min(1, FARTHEST_M / distance);
    this.led = true;
    this.showMagnet([north * scale, west * scale, up * scale]);
    this.moved();
  }

  private toggleMagnet(): void {
    if (!this.magnet) return this.leadMagnet(FIRST_PLACE);
    this.showMagnet(null);
    this.perform([{ do: "take_magnet_away" }]);
  }

  private showMagnet(place: Place | null): void {
    this.magnet = place;
    setText(this.holder, place ? "Take away" : "Hold");
    this.holder.setAttribute("aria-pressed", String(place !== null));
    const side = (value: number, positive: string, negative: string): string => `${fixed(100 * Math.abs(value), 0)}${value < 0 ? negative : positive}`;
    setText(this.place, place ? `${side(place[0], "N", "S")} ${side(place[1], "W", "E")} ${fixed(100 * place[2], 0)} cm` : "");
  }

  private grab(): void {
    const { element } = this.picture;
    element.tabIndex = 0;
    element.setAttribute("role", "application");
    element.setAttribute("aria-label", "The board. Drag to turn it, Shift and drag to roll it about the line of sight. Arrow keys tilt, Q and E turn, Page Up and Page Down lift, 0 lays it flat.");
    element.classList.add("board-view");
    const held = new Map<number, [number, number]>();
    let leads: number | null = null; // the pointer that drags the magnet
    element.addEventListener("pointerdown", (event) => {
      element.setPointerCapture(event.pointerId);
      if (this.picture.onMagnet(event)) leads = event.pointerId;
      else held.set(event.pointerId, [event.clientX, event.clientY]);
      element.focus();
      event.preventDefault();
    });
    element.addEventListener("pointermove", (event) => {
      if (leads === event.pointerId) {
        const place = this.picture.under(event, this.magnet?.[2] ?? 0);
        if (place) this.leadMagnet(place);
        return;
      }
      if (!held.size) element.classList.toggle("on-magnet", this.picture.onMagnet(event));
      const before = held.get(event.pointerId);
      if (!before) return;
      const dx = event.clientX - before[0], dy = event.clientY - before[1];
      held.set(event.pointerId, [event.clientX, event.clientY]);
      if (held.size > 1) this.liftTo(this.metres - dy * 0.01);
      else if (event.shiftKey) this.turnBy(this.picture.towards, -dx * DEGREES_PER_PIXEL);
      else {
        this.turnBy(this.picture.right, dy * DEGREES_PER_PIXEL);
        this.turnBy([0, 0, 1], dx * DEGREES_PER_PIXEL);
      }
    });
    const release = (event: PointerEvent): void => {
      held.delete(event.pointerId);
      if (leads === event.pointerId) leads = null;
    };
    element.addEventListener("pointerup", release);
    element.addEventListener("pointercancel", release);
    element.addEventListener("wheel", (event) => {
      this.liftTo(this.metres - event.deltaY * 0.001);
      event.preventDefault();
    }, { passive: false });
    element.addEventListener("keydown", (event) => {
      const move = this.moves[event.key.length === 1 ? event.key.toLowerCase() : event.key];
      if (!move) return;
      move(event.shiftKey ? 1 : 5);
      event.preventDefault();
    });
  }

  // The keys of HAND_KEYS; the step is in degrees.
  private readonly moves: Record<string, (step: number) => void> = {
    ArrowUp: (step) => this.turnBy([1, 0, 0], -step, true),
    ArrowDown: (step) => this.turnBy([1, 0, 0], step, true),
    ArrowLeft: (step) => this.turnBy([0, 1, 0], -step, true),
    ArrowRight: (step) => this.turnBy([0, 1, 0], step, true),
    q: (step) => this.turnBy([0, 0, 1], step),
    e: (step) => this.turnBy([0, 0, 1], -step),
    PageUp: () => this.liftTo(this.metres + 0.1),
    PageDown: () => this.liftTo(this.metres - 0.1),
    "0": () => this.flat(),
  };

  private readonly magnetKey = (event: KeyboardEvent): void => {
    const step = event.shiftKey ? 0.05 : 0.01;
    const moves: Record<string, Place> = { // one looks to the west: north is at the right
      ArrowRight: [step, 0, 0], ArrowLeft: [-step, 0, 0], ArrowUp: [0, step, 0], ArrowDown: [0, -step, 0], PageUp: [0, 0, step], PageDown: [0, 0, -step],
    };
    const move = moves[event.key];
    if (!move || !this.magnet) return;
    const [north, west, up] = this.magnet;
    this.leadMagnet([north + move[0], west + move[1], up + move[2]]);
    event.preventDefault();
  };

  private flat(): void {
    this.turnTo(toMatrix({ roll: 0, pitch: 0, yaw: 0 }));
    this.liftTo(0);
  }

  private perform(entries: Entry[]): void {
    this.movedAt = 0;
    for (const entry of entries) this.act(entry);
  }

  private build(): HTMLElement {
    const angle = (): void => {
      const value = (name: string): number => Number(this.sliders[name]?.input.value ?? 0);
      this.turnTo(toMatrix({ roll: value("roll"), pitch: value("pitch"), yaw: value("yaw") }));
    };
    return el("div", { class: "hand" },
      el("div", { class: "sliders" },
        this.slider("roll", "Roll", -180, 180, 0.5, 1, "°", angle),
        this.slider("pitch", "Pitch", -90, 90, 0.5, 1, "°", angle),
        this.slider("yaw", "Yaw", -180, 180, 0.5, 1, "°", angle),
        this.slider("height", "Height", -1, 10, 0.01, 2, " m", () => this.liftTo(Number(this.sliders["height"]?.input.value ?? 0))),
        el("div", { class: "slider magnet", keydown: this.magnetKey }, el("span", {}, "Magnet"), this.holder, this.place)),
      this.gestures);
  }

  // Motions with the scenario's words.
  offer(gestures: Gesture[]): void {
    this.gestures.replaceChildren(...gestures.map(({ word, label, doc, entries }) => button(label, doc, () => word === "flat" ? this.flat() : this.perform(entries), { "data-gesture": word })));
  }

  private slider(name: string, text: string, low: number, high: number, step: number, digits: number, unit: string, change: () => void): HTMLElement {
    const input = el("input", { type: "range", id: `slide-${name}`, min: String(low), max: String(high), step: String(step), value: "0", input: change });
    const output = el("output", { for: `slide-${name}` });
    this.sliders[name] = { input, output, digits, unit };
    this.showSlider(name, 0);
    return el("label", { class: "slider" }, el("span", {}, text), input, output);
  }

  private showAngles(angles: Angles): void {
    for (const name of ["roll", "pitch", "yaw"] as const) this.showSlider(name, angles[name]);
  }

  private showSlider(name: string, value: number): void {
    const slider = this.sliders[name];
    if (!slider) return;
    if (document.activeElement !== slider.input || performance.now() - this.movedAt > HELD_MS) slider.input.value = String(value);
    setText(slider.output, fixed(value, slider.digits) + slider.unit);
  }
}
