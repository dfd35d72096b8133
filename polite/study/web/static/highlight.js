/** The step in which passages of the preferred clip are marked. */

import { Controls, seconds } from "./controls.js";
import { announce } from "./live.js";
import { Marks, NAMES } from "./marks.js";
import { mayMove, Player } from "./player.js";
import { Timeline } from "./timeline.js";

/** The second tap of a double one on the answer before comes within this time [ms]. */
const SETTLING = 500;

const SIDES = { left: "A – left", right: "B – right" };

export class HighlightStep {
  /** @param {{changed: (kept) => void, confirmed: (marks) => void, left: () => void, broken: (player) => void}} on */
  constructor(root, store, on) {
    this.root = root;
    this.on = on;
    this.heading = root.querySelector("h1");
    this.previewing = false;
    this.player = new Player([root.querySelector("video")]);
    this.controls = new Controls(root.querySelector(".controls"), this.player, store);
    this.timeline = new Timeline(root.querySelector('[data-show="timeline"]'), {
      place: (name, start, merged) => this.#move(name, start, merged),
      pick: (name) => this.#pick(name),
    });
    this.player.addEventListener("step", () => this.timeline.moveHead(this.player.step));
    this.player.addEventListener("broken", () => on.broken(this.player));
    this.#bind();
  }

  /** Show a clip; `kept` are the marks so far. */
  open(clip, side, trial, kept) {
    this.marks = new Marks(clip.steps, trial.highlight.length, kept);
    this.fps = trial.fps;
    this.previewing = false;
    this.timeline.open(clip.strip, clip.steps, trial.fps, this.marks);
    this.player.load([clip], trial.fps);
    this.controls.show(trial.speeds);
    this.root.querySelector('[data-show="which"]').textContent = `${SIDES[side]} (you prefer it)`;
    this.#show();
    this.#settle();
    if (mayMove()) this.player.play();
  }

  close() {
    this.player.pause();
  }

  /** Whether the key was used. */
  key(key, event) {
    const { active } = this.marks.now;
    const stride = event.shiftKey ? this.marks.size : 1;
    const acts = {
      " ": () => this.player.toggle(),
      ",": () => this.player.nudge(-1),
      ".": () => this.player.nudge(1),
      s: () => announce(`Speed ${this.controls.faster()}`),
      g: () => this.#pick("good", true),
      b: () => this.#pick("bad", true),
      p: () => this.#preview(active),
      n: () => this.#nothing(),
      u: () => this.#undo(),
      undo: () => this.#undo(),
      Delete: () => this.#clear(active),
      Enter: () => this.#enter(active, event),
      ArrowLeft: () => this.#shift(active, -stride, event),
      ArrowRight: () => this.#shift(active, stride, event),
      Escape: () => this.on.left(),
      Backspace: () => this.on.left(),
    };
    acts[key]?.();
    return key in acts;
  }

  /** The timeline lies where the answers were: let no tap through that was meant for one of them. */
  #settle() {
    clearTimeout(this.settling);
    this.root.classList.add("settling");
    this.settling = setTimeout(() => this.root.classList.remove("settling"), SETTLING);
  }

  #bind() {
    const press = (root, name, act) =>
      root.querySelector(`[data-do="${name}"]`).addEventListener("click", act);
    for (const name of NAMES) {
      const box = this.#box(name);
      press(box, "pick", () => this.#pick(name, true));
      press(box, "place", () => this.#here(name));
      press(box, "preview", () => this.#preview(name));
      press(box, "clear", () => this.#clear(name));
    }
    press(this.root, "nothing", () => this.#nothing());
    press(this.root, "undo", () => this.#undo());
    press(this.root, "confirm", () => this.on.confirmed(this.marks.now));
    press(this.root, "leave", () => this.on.left());
  }

  #pick(name, said = false) {
    if (name !== this.marks.now.active) this.previewing = false;
    this.marks.pick(name);
    this.#changed();
    if (said) announce(`${name} passage chosen, ${this.#words(name)}`);
  }

  /** Mark around the step that is shown. */
  #here(name) {
    this.#place(name, this.marks.around(this.player.step));
  }

  #place(name, start, merged = false) {
    if (name !== this.marks.now.active) this.previewing = false;
    this.marks.place(name, start, merged);
    this.#changed();
    this.timeline.announce(name);
  }

  /** Move a window; a clip that rests shows where it starts. */
  #move(name, start, merged) {
    this.#place(name, start, merged);
    if (!this.player.playing) this.player.seek(this.marks.now[name]);
  }

  #shift(name, steps, event) {
    const start = this.marks.now[name];
    if (start === null) this.player.nudge(steps);
    else this.#move(name, start + steps, event.repeat);
  }

  #enter(name, event) {
    if (event.repeat) return;
    if (this.marks.now[name] === null && !this.marks.now.nothing) this.#here(name);
    else this.on.confirmed(this.marks.now);
  }

  #clear(name) {
    this.previewing = false;
    this.marks.clear(name);
    this.#changed();
    announce(`${name} passage cleared`);
  }

  /** One act is enough: whoever pressed it by mistake goes back to this comparison. */
  #nothing() {
    this.previewing = false;
    this.marks.clearAll();
    this.#changed();
    this.on.confirmed(this.marks.now);
  }

  #undo() {
    this.previewing = false;
    const undone = this.marks.undo();
    this.#changed();
    announce(undone ? "Undone" : "There is nothing to undo");
  }

  /** Loop the window, or the whole clip again. */
  #preview(name) {
    if (this.marks.now[name] === null) return;
    this.previewing = !(this.previewing && this.marks.now.active === name);
    this.marks.pick(name);
    this.#changed();
    if (!this.previewing) return;
    this.player.seek(this.marks.now[name]);
    this.player.play();
  }

  #changed() {
    this.on.changed(this.marks.kept);
    this.#show();
  }

  #show() {
    const { now, size } = this.marks;
    const start = now[now.active];
    const focused = document.activeElement;
    this.player.range = this.previewing ? [start, start + size - 1] : null;
    this.timeline.show();
    for (const name of NAMES) this.#showMark(name);
    this.#button("undo").disabled = this.marks.past.length === 0;
    this.#button("confirm").disabled = !this.marks.complete;
    this.#text("confirm", this.marks.complete ? "" : "Mark a passage or say that nothing stands out.");
    this.#text("help", `Tap the timeline to mark the ${now.active} passage there; drag it to move it.`);
    if (focused.disabled || focused.hidden) this.#box(now.active).querySelector("button").focus();
  }

  #showMark(name) {
    const box = this.#box(name);
    const placed = this.marks.now[name] !== null;
    const active = this.marks.now.active === name;
    box.classList.toggle("active", active);
    box.querySelector('[data-do="pick"]').setAttribute("aria-pressed", active);
    box.querySelector('[data-show="state"]').textContent = this.#words(name);
    const preview = box.querySelector('[data-do="preview"]');
    preview.disabled = !placed;
    preview.setAttribute("aria-pressed", active && this.previewing);
    box.querySelector('[data-do="clear"]').disabled = !placed;
  }

  #words(name) {
    const start = this.marks.now[name];
    if (start === null) return "not marked";
    return `${seconds(start, this.fps)} to ${seconds(start + this.marks.size, this.fps)}`;
  }

  #box(name) {
    return this.root.querySelector(`[data-mark="${name}"]`);
  }

  #button(name) {
    return this.root.querySelector(`[data-do="${name}"]`);
  }

  #text(name, text) {
    this.root.querySelector(`[data-show="${name}"]`).textContent = text;
  }
}
