/** What this page keeps in the browser, filed under the participant; lost when storage is blocked. */

const memory = new Map();

export class Store {
  /** @param {string} owner differs from participant to participant */
  constructor(owner) {
    this.prefix = `study:${owner}:`;
  }

  read(name) {
    const key = this.prefix + name;
    try {
      return JSON.parse(localStorage.getItem(key) ?? memory.get(key) ?? "null");
    } catch {
      return JSON.parse(memory.get(key) ?? "null");
    }
  }

  write(name, value) {
    const [key, text] = [this.prefix + name, JSON.stringify(value)];
    try {
      localStorage.setItem(key, text);
      memory.delete(key);
    } catch {
      memory.set(key, text); // full or blocked: this tab still knows
    }
  }

  remove(name) {
    memory.delete(this.prefix + name);
    try {
      localStorage.removeItem(this.prefix + name);
    } catch {
      // blocked: nothing was kept
    }
  }

  /** Forget everything of this participant, as after a withdrawal. */
  clear() {
    memory.clear();
    try {
      const keys = Object.keys(localStorage).filter((key) => key.startsWith(this.prefix));
      keys.forEach((key) => localStorage.removeItem(key));
    } catch {
      // blocked: nothing was kept
    }
  }
}
