/**
 * Clips that play in step by one clock.
 *
 * The longest clip is the clock; the others follow it, wait for it and are waited for. A shorter one
 * rests on its last frame until all have ended. Step k lasts from k / fps to (k + 1) / fps.
 *
 * Events: "step" (another step is shown), "state" (plays or not), "lap" (played to the end),
 * "watched" (every step was played once; scrubbing does not count), "broken" (cannot be loaded).
 */

/** Clips further apart than this are brought together [s], unless a step lasts longer. */
const APART = 0.08;

/** Media time between two looks at the clock that still counts as played [s at speed 1]. */
const GLANCE = 1;

/** Ends are never met exactly [s]. */
const HAIR = 0.005;

export class Player extends EventTarget {
  #videos;
  #steps = [];
  #clock = null;
  #wanted = false;
  #last = 0;
  #played = new Set();
  #frame = 0;

  constructor(videos) {
    super();
    this.#videos = videos;
    this.fps = 10;
    this.speed = 1;
    this.range = null; // [first, last] step that is looped, or null for the whole clip
    for (const video of videos) {
      video.addEventListener("error", () => video.getAttribute("src") && this.#emit("broken"));
      video.addEventListener("seeked", () => this.#emit("step"));
      video.addEventListener("loadeddata", () => this.#emit("step"));
    }
    document.addEventListener("visibilitychange", () => this.#hidden());
  }

  /** Show clips [{video, steps, width, height}] of `fps` steps a second, from their first step. */
  load(clips, fps) {
    this.pause();
    this.fps = fps;
    this.range = null;
    this.#played.clear();
    this.#steps = clips.map(({ steps }) => steps);
    this.#clock = this.#videos[this.#steps.indexOf(this.steps)];
    clips.forEach(({ video, width, height }, index) => {
      const element = this.#videos[index];
      element.width = width;
      element.height = height;
      element.style.setProperty("--ratio", width / height);
      element.src = video;
      element.currentTime = 0.5 / fps;
    });
    this.#emit("step");
  }

  /** Fetch them again after a failure. */
  reload() {
    for (const video of this.#videos) if (video.error) video.load();
    if (this.#wanted) this.play();
  }

  get steps() {
    return Math.max(...this.#steps);
  }

  get step() {
    const step = Math.floor(this.#clock.currentTime * this.fps + HAIR);
    return Math.max(0, Math.min(step, this.steps - 1));
  }

  get playing() {
    return this.#wanted;
  }

  /** Share of the steps that were played. */
  get share() {
    return this.#played.size / this.steps;
  }

  play() {
    this.#wanted = true;
    if (this.#over()) this.#rewind();
    this.#last = this.#clock.currentTime;
    this.#start();
    cancelAnimationFrame(this.#frame);
    this.#frame = requestAnimationFrame(() => this.#tick());
    this.#emit("state");
  }

  pause() {
    this.#wanted = false;
    cancelAnimationFrame(this.#frame);
    for (const video of this.#videos) video.pause();
    this.#emit("state");
  }

  toggle() {
    if (this.#wanted) this.pause();
    else this.play();
  }

  /** Show a step, and go on from there if it plays. */
  seek(step) {
    const wanted = Math.max(0, Math.min(step, this.steps - 1));
    this.#videos.forEach((video, index) => {
      video.currentTime = (Math.min(wanted, this.#steps[index] - 1) + 0.5) / this.fps;
    });
    this.#last = this.#clock.currentTime;
    this.#emit("step");
  }

  /** One step on or back, paused. */
  nudge(steps) {
    const from = this.step;
    this.pause();
    this.seek(from + steps);
  }

  #tick() {
    if (!this.#wanted) return;
    this.#frame = requestAnimationFrame(() => this.#tick());
    this.#count();
    if (this.#over()) {
      this.#emit("lap");
      this.#rewind();
    }
    if (this.#gather()) this.#start();
    this.#emit("step");
  }

  /** Note the steps that were played to their end since the last look. */
  #count() {
    const now = this.#clock.ended ? this.steps / this.fps : this.#clock.currentTime;
    const passed = now - this.#last;
    if (passed > 0 && passed < GLANCE * Math.max(1, this.speed)) {
      const first = Math.floor(this.#last * this.fps + HAIR);
      for (let step = first; (step + 1) / this.fps <= now + HAIR; step += 1) this.#add(step);
    }
    this.#last = now;
  }

  #add(step) {
    const before = this.#played.size;
    if (step < this.steps) this.#played.add(step);
    if (before < this.steps && this.#played.size === this.steps) this.#emit("watched");
  }

  #over() {
    const end = this.range ? (this.range[1] + 1) / this.fps : this.steps / this.fps;
    return this.#clock.ended || this.#clock.currentTime >= end - HAIR;
  }

  #rewind() {
    const start = this.range ? this.range[0] / this.fps + HAIR : 0;
    for (const video of this.#videos) video.currentTime = start;
    this.#last = start;
  }

  /** Whether all clips can play on together; those that could are held back while one cannot. */
  #gather() {
    const now = this.#clock.currentTime;
    const active = this.#active();
    for (const video of active) {
      const apart = Math.abs(video.currentTime - now);
      if (!video.seeking && apart > Math.max(APART, 1 / this.fps)) video.currentTime = now;
    }
    const ready = active.filter((video) => !video.seeking && video.readyState >= 3);
    const together = ready.length === active.length;
    if (!together) for (const video of ready) video.pause();
    return together;
  }

  #start() {
    for (const video of this.#active()) {
      if (video.playbackRate !== this.speed) {
        video.defaultPlaybackRate = this.speed;
        video.playbackRate = this.speed;
      }
      if (video.paused) video.play().catch((error) => this.#refused(error));
    }
  }

  /** The clips that have not ended; a browser's own end is not taken for the clip's last step. */
  #active() {
    const now = this.#clock.currentTime;
    return this.#videos.filter((video, index) => {
      const end = this.#steps[index] / this.fps;
      return video === this.#clock ? !video.ended : now < end - 1 / this.fps;
    });
  }

  /** A browser may forbid playing without being asked. */
  #refused(error) {
    if (error.name === "NotAllowedError") this.pause();
  }

  /** Nothing counts as watched in a tab that cannot be seen. */
  #hidden() {
    if (!this.#wanted) return;
    if (document.hidden) for (const video of this.#videos) video.pause();
    else this.#last = this.#clock.currentTime;
  }

  #emit(name) {
    if (this.#clock) this.dispatchEvent(new Event(name));
  }
}

/** Whether clips may start by themselves. */
export function mayMove() {
  return !matchMedia("(prefers-reduced-motion: reduce)").matches;
}
