/** The two windows that a participant marks, with undo; knows nothing of the page. */

export const NAMES = ["good", "bad"];

const EMPTY = { good: null, bad: null, nothing: false, active: "good" };

export class Marks {
  /**
   * @param {number} steps of the clip
   * @param {number} length L of a window, which has L + 1 steps
   * @param {{now, past}|null} kept what `kept` gave earlier
   */
  constructor(steps, length, kept = null) {
    this.size = Math.min(length + 1, steps);
    this.latest = steps - this.size;
    this.now = { ...EMPTY, ...kept?.now };
    this.past = kept?.past ?? [];
  }

  get kept() {
    return { now: this.now, past: this.past };
  }

  get complete() {
    return this.now.nothing || NAMES.some((name) => this.now[name] !== null);
  }

  /** The latest start that fits, at or before `step`. */
  fit(step) {
    return Math.max(0, Math.min(Math.round(step), this.latest));
  }

  /** The start of a window whose middle is `step`. */
  around(step) {
    return this.fit(step - Math.floor(this.size / 2));
  }

  /** Which window the next marks are for. */
  pick(name) {
    this.now = { ...this.now, active: name };
  }

  /** Let a window start at a step; `merged` makes it one change with the one before. */
  place(name, start, merged = false) {
    this.#change({ [name]: this.fit(start), nothing: false, active: name }, merged);
  }

  clear(name) {
    if (this.now[name] !== null) this.#change({ [name]: null, active: name });
  }

  /** Nothing stands out; takes the windows away. */
  clearAll() {
    this.#change({ good: null, bad: null, nothing: true });
  }

  undo() {
    const before = this.past.at(-1);
    if (!before) return false;
    this.past = this.past.slice(0, -1);
    this.now = before;
    return true;
  }

  #change(difference, merged = false) {
    const next = { ...this.now, ...difference };
    if (JSON.stringify(next) === JSON.stringify(this.now)) return;
    if (!merged) this.past = [...this.past, this.now];
    this.now = next;
  }
}
