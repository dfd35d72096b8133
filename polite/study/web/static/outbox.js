/** Messages that the server must get, in order; each is kept in the browser until it is confirmed. */

import { post, Problem } from "./api.js";

/** Waits between attempts [s]; the last one is repeated. */
const WAITS = [1, 2, 4, 8, 15];

/** How often a message that comes too soon is sent again. */
const TOO_SOON = 20;

export class Outbox {
  #results = new Map(); // id -> resolve of the promise that `send` gave
  #busy = false;
  #working = null; // promise of the results
  #wake = () => {};

  /**
   * @param {Store} store
   * @param {{waiting: (problem, seconds) => void, through: () => void}} tell called when a message
   *   has to wait, and when one got through
   */
  constructor(store, tell) {
    this.store = store;
    this.tell = tell;
    addEventListener("online", () => this.hurry());
  }

  get items() {
    return this.store.read("outbox") ?? [];
  }

  /** Keep a message and send it; the promise gives {reply} or, if it was refused, {problem}. */
  send(id, path, body) {
    this.store.write("outbox", [...this.items, { id, path, body }]);
    const result = new Promise((resolve) => this.#results.set(id, resolve));
    this.hurry(); // what was waiting and this go together
    this.flush();
    return result;
  }

  /** Send what waits; ends when nothing waits, or when the server wants this page no more. */
  flush() {
    if (!this.#busy) {
      this.#busy = true;
      this.#working = this.#work();
    }
    return this.#working;
  }

  /** Try again now. */
  hurry() {
    this.#wake();
  }

  async #work() {
    const results = [];
    for (let attempt = 0, item; (item = this.items[0]); ) {
      const result = await this.#attempt(item);
      if (result.problem && this.#again(result.problem, item, attempt)) {
        const seconds = Math.max(WAITS[Math.min(attempt, WAITS.length - 1)], result.problem.wait);
        this.tell.waiting(result.problem, seconds);
        await this.#pause(seconds);
        attempt += 1;
        continue;
      }
      attempt = 0;
      this.tell.through();
      results.push(result);
      const kept = [401, 403].includes(result.problem?.status); // a new session can send it
      if (!kept) this.store.write("outbox", this.items.filter(({ id }) => id !== item.id));
      this.#results.get(item.id)?.(result);
      this.#results.delete(item.id);
      if (kept) break;
    }
    this.#busy = false;
    this.#letGo();
    return results;
  }

  /** Another tab has sent what is not here any more; nobody shall wait for its reply. */
  #letGo() {
    const kept = new Set(this.items.map(({ id }) => id));
    for (const [id, resolve] of this.#results) {
      if (kept.has(id)) continue;
      this.#results.delete(id);
      this.tell.through();
      resolve({ problem: new Problem(409, { elsewhere: true }) });
    }
  }

  async #attempt({ path, body }) {
    try {
      return { reply: await post(path, body) };
    } catch (problem) {
      return { problem };
    }
  }

  /** The server refuses "watched" while its own clock says that this cannot be. */
  #again(problem, { path }, attempt) {
    const soon = problem.status === 422 && path.endsWith("/watched") && attempt < TOO_SOON;
    return problem.retry || soon;
  }

  #pause(seconds) {
    return new Promise((resolve) => {
      const timer = setTimeout(resolve, seconds * 1000);
      this.#wake = () => {
        clearTimeout(timer);
        resolve();
      };
    });
  }
}
