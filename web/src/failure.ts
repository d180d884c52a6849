// A strip over the board when the firmware has crashed or hangs: the diagnosis in a line, and ways to continue.

import { button, el, setText } from "./dom";

export class FailureStrip {
  readonly element: HTMLElement;
  private readonly text = el("p", { id: "failure-text" });

  constructor(details: () => void, reset: () => void) {
    this.element = el("div", { class: "failure", role: "alert", id: "failure", hidden: true },
      el("strong", {}, "The firmware has stopped"), this.text,
      el("div", {}, button("Details", "Open the diagnosis: registers, callers, advice", details), button("Power on again", "Reset the board", reset)));
  }

  show(summary: string): void {
    this.element.hidden = !summary;
    setText(this.text, summary);
  }
}
