// A row of tabs with the keys that the ARIA pattern asks for: arrows, Home and End; one tab is in the order of Tab.

import { el } from "./dom";

export interface Tab { id: string; name: string; attributes?: Record<string, string>; more?: Node }

export class TabRow {
  readonly element: HTMLElement;

  // `choose` is called when the user chooses a tab; `panel` is the id of the element that the tabs change, if it is one.
  constructor(label: string, private readonly choose: (id: string) => void, private readonly panel = "") {
    this.element = el("div", { class: "tabs", role: "tablist", "aria-label": label, keydown: (event: KeyboardEvent) => this.key(event) });
  }

  offer(tabs: Tab[]): void {
    this.element.replaceChildren(...tabs.map(({ id, name, attributes = {}, more }) => el("button", {
      type: "button", role: "tab", "data-tab": id, ...(this.panel ? { "aria-controls": this.panel } : {}), ...attributes, click: () => this.choose(id),
    }, name, more ?? null)));
  }

  select(id: string): void {
    const tabs = this.tabs(), chosen = tabs.find((tab) => tab.dataset["tab"] === id);
    for (const tab of tabs) {
      tab.setAttribute("aria-selected", String(tab === chosen));
      tab.tabIndex = tab === (chosen ?? tabs[0]) ? 0 : -1;
    }
  }

  private tabs(): HTMLElement[] {
    return [...this.element.children] as HTMLElement[];
  }

  private key(event: KeyboardEvent): void {
    const tabs = this.tabs(), at = tabs.indexOf(document.activeElement as HTMLElement);
    const to: Record<string, number> = { ArrowRight: at + 1, ArrowLeft: at - 1, Home: 0, End: -1 };
    const index = to[event.key];
    if (at < 0 || index === undefined) return;
    const tab = tabs.at(index % tabs.length);
    tab?.focus();
    tab?.click();
    event.preventDefault();
  }
}
