/** The step in which one of two clips is preferred. */

import { Controls } from "./controls.js";
import { announce } from "./live.js";
import { mayMove, Player } from "./player.js";

export const WORDS = {
  left: "prefer A (left)",
  right: "prefer B (right)",
  equal: "equal",
  incomparable: "cannot compare",
};

/** Arrows up and down scroll, so they answer nothing. */
const KEYS = {
  ArrowLeft: "left",
  ArrowRight: "right",
  e: "equal",
  c: "incomparable",
};

export class ChoiceStep {
  /** @param {{watched: () => void, lap: () => void, chosen: (choice) => void, move: (by) => void, broken: (player) => void}} on */
  constructor(root, store, on) {
    this.root = root;
    this.on = on;
    this.heading = root.querySelector("h1");
    this.player = new Player([...root.querySelectorAll("video")]);
    this.controls = new Controls(root.querySelector(".controls"), this.player, store);
    this.buttons = [...root.querySelectorAll("[data-choice]")];
    this.turns = { previous: -1, next: 1 };
    for (const button of this.buttons)
      button.addEventListener("click", () => on.chosen(button.dataset.choice));
    for (const [name, by] of Object.entries(this.turns))
      this.#button(name).addEventListener("click", () => on.move(by));
    this.player.addEventListener("step", () => this.#progress());
    this.player.addEventListener("watched", () => this.#watched());
    this.player.addEventListener("lap", () => this.#lap());
    this.player.addEventListener("broken", () => on.broken(this.player));
  }

  /** Show a trial; `draft` says whether it was watched and what was chosen before. */
  open(trial, draft) {
    this.watched = draft.watched;
    this.first = false;
    this.chosen = draft.choice ?? trial.answer?.choice ?? null;
    this.player.load([trial.left, trial.right], trial.fps);
    this.controls.show(trial.speeds);
    this.#button("previous").hidden = trial.number === 1;
    this.#button("next").hidden = trial.place >= trial.current;
    this.root.querySelector('[data-show="hint"]').textContent = hint(trial);
    for (const button of this.buttons) {
      button.setAttribute("aria-pressed", button.dataset.choice === this.chosen);
    }
    this.#enable();
    if (mayMove()) this.player.play();
  }

  close() {
    this.player.pause();
  }

  /** Whether the key was used. */
  key(key, event) {
    const { player } = this;
    if (key === " ") player.toggle();
    else if (key === ",") player.nudge(-1);
    else if (key === ".") player.nudge(1);
    else if (key === "s") announce(`Speed ${this.controls.faster()}`);
    else if (KEYS[key]) this.#choose(KEYS[key], event);
    else return false;
    return true;
  }

  #choose(choice, event) {
    if (event.repeat) return;
    if (this.watched) this.on.chosen(choice);
    else announce("Please watch both clips to the end first.");
  }

  /** The lap in which the last step was watched is no replay. */
  #lap() {
    if (this.watched && !this.first) this.on.lap();
    this.first = false;
  }

  #watched() {
    if (this.watched) return;
    this.watched = true;
    this.first = true;
    this.#enable();
    announce("Both clips were watched. You can answer now.");
    this.on.watched();
  }

  #enable() {
    for (const button of this.buttons) button.disabled = !this.watched;
    this.#progress();
  }

  #progress() {
    const element = this.root.querySelector('[data-show="watched"]');
    const seen = Math.floor(100 * this.player.share);
    const text = this.watched
      ? "✓ Both clips were watched. You can answer now, or watch them again."
      : `Please watch both clips to the end; then you can answer (${seen} % watched).`;
    if (element.textContent !== text) element.textContent = text;
    element.classList.toggle("done", this.watched);
  }

  #button(name) {
    return this.root.querySelector(`[data-do="${name}"]`);
  }
}

function hint(trial) {
  const stored = trial.answer;
  if (stored) return `Your answer is stored: ${WORDS[stored.choice]}. You can change it.`;
  if (trial.phase === "practice")
    return "This is for practice: afterwards you see what most people answer.";
  if (trial.number === 1 && trial.place > 0)
    return "The practice is over. From now on there is no feedback.";
  return "";
}
