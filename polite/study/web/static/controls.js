/** Play, step, scrub and speed of one player. */

/** Seconds as they are shown everywhere. */
export const seconds = (step, fps) => `${(step / fps).toFixed(1)} s`;

/** Whoever used the mouse answers by ← and → next; a control that kept the focus would take them. */
function letGo(input) {
  if (!input.matches(":focus-visible")) input.blur();
}

export class Controls {
  /** @param {Store} store where the speed is kept from trial to trial */
  constructor(root, player, store) {
    this.player = player;
    this.store = store;
    this.part = (name) => root.querySelector(`[data-show="${name}"]`);
    this.scrub = root.querySelector('[data-do="scrub"]');
    const press = (name, act) =>
      root.querySelector(`[data-do="${name}"]`).addEventListener("click", act);
    press("play", () => player.toggle());
    press("back", () => player.nudge(-1));
    press("forward", () => player.nudge(1));
    this.scrub.addEventListener("input", () => player.seek(Number(this.scrub.value)));
    this.scrub.addEventListener("click", () => this.scrub.blur());
    player.addEventListener("step", () => this.#step());
    player.addEventListener("state", () => this.#state());
  }

  /** Fit the controls to the clips that were loaded; `speeds` are offered. */
  show(speeds) {
    const kept = this.store.read("speed");
    this.speeds = speeds;
    this.scrub.max = this.player.steps - 1;
    this.#offer(speeds.includes(kept) ? kept : 1);
    this.shown = null;
    this.#step();
    this.#state();
  }

  /** The next speed. */
  faster() {
    const next = this.speeds[(this.speeds.indexOf(this.player.speed) + 1) % this.speeds.length];
    this.#offer(next);
    this.store.write("speed", next);
    return next;
  }

  #offer(chosen) {
    const box = this.part("speeds");
    this.player.speed = chosen;
    box.replaceChildren(...this.speeds.map((speed) => this.#radio(box, speed, speed === chosen)));
  }

  #radio(box, speed, checked) {
    const label = document.createElement("label");
    const input = document.createElement("input");
    const text = document.createElement("span");
    Object.assign(input, { type: "radio", name: box.dataset.name, value: speed, checked });
    text.textContent = `${speed}×`;
    input.addEventListener("change", () => {
      this.player.speed = speed;
      this.store.write("speed", speed);
    });
    input.addEventListener("click", () => letGo(input)); // also of the speed that it has already
    label.append(input, text);
    return label;
  }

  #step() {
    const { step, steps, fps } = this.player;
    if (step === this.shown) return;
    this.shown = step;
    this.scrub.value = step;
    this.scrub.setAttribute("aria-valuetext", seconds(step, fps));
    this.part("time").textContent = `${seconds(step, fps)} of ${seconds(steps, fps)}`;
  }

  #state() {
    const { playing } = this.player;
    this.part("play").textContent = playing ? "Pause" : "Play";
    this.part("glyph").textContent = playing ? "❚❚" : "▶";
  }
}
