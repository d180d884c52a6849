// The terminal on USART1: what the board prints, and a keyboard for all 256 byte values.

import { FitAddon } from "@xterm/addon-fit";
import { SearchAddon } from "@xterm/addon-search";
import { Terminal } from "@xterm/xterm";
import { button, colour, download, el } from "./dom";
import type { Entry, Text } from "./protocol";

const KEPT = 4 << 20; // characters for "save"
const DIM = "\x1b[2m", END = "\x1b[1;31m";
const AT_ONCE = 1024; // bytes of one entry

export class Serial {
  readonly element: HTMLElement;
  private readonly terminal = new Terminal({
    convertEol: true, scrollback: 20_000, fontSize: 12.5, cursorStyle: "bar", cursorInactiveStyle: "none",
    fontFamily: "ui-monospace, 'SF Mono', Menlo, Consolas, 'DejaVu Sans Mono', monospace",
  });
  private readonly fit = new FitAddon();
  private readonly find = new SearchAddon();
  private readonly screen = el("div", { class: "screen" });
  private kept = "";
  private run = 0;
  private position = 0;
  private ended = false;

  constructor(private readonly act: (entry: Entry) => void) {
    this.terminal.loadAddon(this.fit);
    this.terminal.loadAddon(this.find);
    this.terminal.onData((data) => this.type(new Uint8Array([...data].flatMap(bytesOf))));
    this.terminal.onBinary((data) => this.type(Uint8Array.from(data, (one) => one.charCodeAt(0))));
    const search = el("input", {
      type: "search", placeholder: "Find", "aria-label": "Find in the terminal", class: "short",
      keydown: (event: KeyboardEvent) => {
        if (event.key !== "Enter") return;
        if (event.shiftKey) this.find.findPrevious(search.value);
        else this.find.findNext(search.value);
      },
    });
    const hex = el("input", {
      type: "text", placeholder: "Send hex: 0d 0a", "aria-label": "Bytes to send in hexadecimal", class: "short", spellcheck: "false",
      keydown: (event: KeyboardEvent) => {
        if (event.key !== "Enter" || !hex.value.trim()) return;
        this.act({ do: "send", hex: hex.value.trim() });
        hex.value = "";
      },
    });
    this.element = el("section", { class: "panel serial", "aria-label": "Terminal" },
      el("header", {}, el("h2", {}, "Terminal"), el("span", { class: "hint" }, "USART1"), el("span", { class: "gap" }), search, hex,
        button("Save", "Save all text", () => download("terminal.txt", new Blob([Uint8Array.from(this.kept, (one) => one.charCodeAt(0))]))),
        button("Clear", "Clear the screen", () => this.terminal.clear())),
      this.screen);
  }

  open(): void {
    this.terminal.open(this.screen);
    this.restyle();
    this.resize();
  }

  resize(): void {
    if (this.screen.clientHeight > 20) this.fit.fit();
  }

  restyle(): void {
    this.terminal.options.theme = {
      background: colour("--surface"), foreground: colour("--ink"), cursor: colour("--accent"),
      selectionBackground: colour("--selected"), red: colour("--bad"), brightRed: colour("--bad"),
    };
  }

  show({ run, position, text }: Text): void {
    if (run !== this.run) {
      if (this.run) this.say("reset");
      this.run = run;
      this.position = position;
      this.ended = false;
    }
    const known = Math.max(0, this.position - position); // what has come already, before a reconnection
    if (position > this.position) this.say(`${position - this.position} bytes omitted`);
    const fresh = text.slice(known);
    this.position = Math.max(this.position, position + text.length);
    this.terminal.write(fresh);
    this.kept = (this.kept + fresh).slice(-KEPT);
  }

  // The end of the text: the firmware has stopped, and prints no more. Shown once, until the next run.
  markEnd(why: string): void {
    if (this.ended) return;
    this.ended = true;
    this.say(`the firmware has stopped: ${why}`, END);
  }

  // The firmware runs after all, as after a watchdog's reset.
  unmarkEnd(): void {
    this.ended = false;
  }

  private say(what: string, style = DIM): void {
    const harmless = what.replaceAll(/[\x00-\x1f\x7f-\x9f]/g, "?"); // a name in a file may have control characters
    this.terminal.write(`\r\n${style}--- ${harmless} ---\x1b[0m\r\n`);
  }

  private type(bytes: Uint8Array): void {
    for (let at = 0; at < bytes.length; at += AT_ONCE) {
      const piece = bytes.slice(at, at + AT_ONCE);
      this.act({ do: "send", hex: [...piece].map((one) => one.toString(16).padStart(2, "0")).join(" ") });
    }
  }
}

// Latin-1 where a character has a byte there, UTF-8 for the rest.
function bytesOf(character: string): number[] {
  const code = character.codePointAt(0) ?? 0;
  return code < 256 ? [code] : [...new TextEncoder().encode(character)];
}
