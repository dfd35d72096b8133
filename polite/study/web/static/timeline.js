/** The film strip with the windows on it: click to place, drag or keys to move. */

import { seconds } from "./controls.js";
import { announce } from "./live.js";
import { NAMES } from "./marks.js";

const percent = (part, whole) => `${(100 * part) / whole}%`;

/** Put a window where it belongs on a timeline of `steps` steps. */
export function lay(element, start, size, steps) {
  element.style.left = percent(start, steps);
  element.style.width = percent(size, steps);
}

export class Timeline {
  /** @param {{place: (name, start, merged) => void, pick: (name) => void}} on what was done to it */
  constructor(root, on) {
    this.root = root;
    this.on = on;
    this.head = root.querySelector('[data-show="head"]');
    this.windows = Object.fromEntries(
      NAMES.map((name) => [name, root.querySelector(`.window.${name}`)]),
    );
    for (const name of NAMES) this.#bind(name, this.windows[name]);
    root.addEventListener("click", (event) => this.#click(event));
  }

  /** Start with a clip's strip and its marks. */
  open(strip, steps, fps, marks) {
    Object.assign(this, { steps, fps, marks });
    this.root.querySelector("img").src = strip;
    this.show();
  }

  /** Draw the windows as they are now. */
  show() {
    for (const name of NAMES) {
      const element = this.windows[name];
      const start = this.marks.now[name];
      element.hidden = start === null;
      element.classList.toggle("active", this.marks.now.active === name);
      if (start === null) continue;
      lay(element, start, this.marks.size, this.steps);
      element.setAttribute("aria-valuemin", 0);
      element.setAttribute("aria-valuemax", this.marks.latest);
      element.setAttribute("aria-valuenow", start);
      element.setAttribute("aria-valuetext", this.words(name));
    }
  }

  /** Where the clip is. */
  moveHead(step) {
    this.head.style.left = percent(step + 0.5, this.steps);
  }

  /** "good passage from 1.2 s to 2.2 s" */
  words(name) {
    const start = this.marks.now[name];
    const [from, to] = [start, start + this.marks.size].map((step) => seconds(step, this.fps));
    return `${name} passage from ${from} to ${to}`;
  }

  /** Say where a window is, unless it has the focus and says so itself. */
  announce(name) {
    if (document.activeElement !== this.windows[name]) announce(this.words(name));
  }

  #stepAt(event) {
    const box = this.root.getBoundingClientRect();
    return ((event.clientX - box.left) / box.width) * this.steps;
  }

  #click(event) {
    if (event.target.closest(".window")) return; // the end of a drag
    const { active } = this.marks.now;
    this.on.place(active, this.marks.around(Math.floor(this.#stepAt(event))), false);
  }

  #bind(name, element) {
    let held = null; // distance from the window's start to the pointer, and whether it has moved
    element.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      element.setPointerCapture(event.pointerId);
      held = { offset: this.#stepAt(event) - this.marks.now[name], moved: false };
      this.on.pick(name);
    });
    element.addEventListener("pointermove", (event) => {
      if (!held) return;
      const start = this.marks.fit(this.#stepAt(event) - held.offset);
      if (start === this.marks.now[name]) return;
      this.on.place(name, start, held.moved);
      held.moved = true;
    });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"])
      element.addEventListener(end, () => (held = null));
    element.addEventListener("focus", () => this.on.pick(name));
    element.addEventListener("keydown", (event) => this.#key(event, name));
  }

  #key(event, name) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const start = this.marks.now[name];
    const stride = event.shiftKey ? this.marks.size : 1;
    const to = {
      ArrowLeft: start - stride,
      ArrowDown: start - stride,
      ArrowRight: start + stride,
      ArrowUp: start + stride,
      PageDown: start - this.marks.size,
      PageUp: start + this.marks.size,
      Home: 0,
      End: this.marks.latest,
    }[event.key];
    if (to === undefined) return;
    event.preventDefault();
    this.on.place(name, to, event.repeat);
  }
}
