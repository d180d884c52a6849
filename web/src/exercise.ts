// The exercise at hand: its question, and a check of the loaded program as `fcu check` makes it, beside the run.

import { button, el, setText } from "./dom";
import type { Check, Checked, Exercise } from "./protocol";
import { linked } from "./source";

const STATES: Record<Checked["state"], string> = {
  checking: "checking…", done: "done", begun: "begun", "not yet": "not yet", unjudged: "not judged", error: "not judged",
};
const SIGNS: Record<Check["outcome"], string> = { passed: "✓", partial: "½", failed: "✗", unjudged: "?" };
const CHOSEN = "fcu-exercise";

export class ExerciseView {
  readonly element: HTMLElement;
  private readonly select: HTMLSelectElement;
  private readonly checker: HTMLButtonElement;
  private readonly question = el("p", { class: "question", id: "exercise-question" });
  private readonly next = el("p", { class: "hint", id: "exercise-next" });
  private readonly outcome = el("p", { class: "outcome", id: "exercise-outcome", role: "status" });
  private readonly list = el("ul", { class: "verdicts", id: "exercise-checks", tabindex: "0", "aria-label": "Checks of the exercise" });
  private exercises: Exercise[] = [];
  private readonly results = new Map<string, Checked>();

  constructor(check: (exercise: string) => void) {
    this.select = el("select", { id: "exercise", "aria-label": "Exercise", change: () => {
      localStorage.setItem(CHOSEN, this.select.value);
      this.render();
    } });
    this.checker = button("Check", "Check the loaded program against this exercise, like fcu check; the board keeps running", () => check(this.select.value), { id: "check", class: "primary" });
    this.element = el("section", { class: "exercise", "aria-labelledby": "exercise-title", hidden: true },
      el("div", { class: "row" }, el("h2", { id: "exercise-title" }, "Exercise"), this.select, this.checker),
      this.question, this.next, this.outcome, this.list);
    this.render();
  }

  offer(exercises: Exercise[]): void {
    const chosen = this.select.value || localStorage.getItem(CHOSEN);
    this.exercises = exercises;
    this.element.hidden = !exercises.length;
    this.select.replaceChildren(...exercises.map(({ id, title }) => el("option", { value: id }, `${id}  ${title}`)));
    this.select.value = exercises.some((one) => one.id === chosen) ? String(chosen) : exercises[0]?.id ?? "";
    this.results.clear();
    this.render();
  }

  show(checked: Checked): void {
    this.results.set(checked.exercise, checked);
    this.render();
  }

  private render(): void {
    for (const option of this.select.options) {
      const one = this.exercises.find(({ id }) => id === option.value), done = this.results.get(option.value)?.state === "done";
      setText(option, `${option.value}${done ? " ✓" : ""}  ${one?.title ?? ""}`);
    }
    const exercise = this.exercises.find(({ id }) => id === this.select.value);
    const result = this.results.get(this.select.value);
    const checking = [...this.results.values()].some((one) => one.state === "checking");
    this.checker.disabled = checking || !exercise;
    setText(this.checker, result?.state === "checking" ? "Checking…" : "Check");
    setText(this.question, exercise?.question ?? "");
    setText(this.next, exercise?.next ?? "");
    this.next.hidden = !exercise?.next || Boolean(result?.checks.length); // the checks have hints
    this.element.dataset["state"] = result?.state ?? "";
    const points = result?.max_points ? `: ${short(result.points)} of ${short(result.max_points)} points` : "";
    const problem = result?.problem ? `: ${result.problem}` : "";
    setText(this.outcome, result ? `${STATES[result.state]}${points}${problem}${result.outdated ? " (before the latest change)" : ""}` : "");
    this.outcome.hidden = !result;
    const causes = (result?.causes ?? []).map(({ summary, details }) => el("li", { class: "cause" }, el("b", { "aria-hidden": "true" }, "!"), el("span", {}, ...linked(summary), ...details.map((text) => el("small", {}, ...linked(text))))));
    this.list.replaceChildren(...causes, ...(result?.checks ?? []).map(line));
    this.list.hidden = !this.list.children.length;
  }
}

function line({ title, outcome, expected, seen, source, hint }: Check): HTMLElement {
  const more = [expected && `expected: ${expected}`, seen && `seen: ${seen}`, source && `line: ${source}`, hint && `hint: ${hint}`].filter((one) => one !== "");
  return el("li", { class: outcome === "passed" ? "met" : outcome === "unjudged" ? "open" : "failed", "data-outcome": outcome },
    el("b", { role: "img", "aria-label": outcome }, SIGNS[outcome]), el("span", {}, title, ...more.map((text) => el("small", {}, ...linked(text)))));
}

function short(points: number): string {
  return String(Math.round(100 * points) / 100);
}
