/** An answer in the making, kept in the browser at every change. */

/** A new draft, or the kept one if it belongs to the same trial and revision. */
export function openDraft(store, trial) {
  const name = `draft:${trial.place}`;
  const kept = store.read(name);
  const draft = kept?.revision === trial.revision ? kept : fresh(trial);
  draft.watched ||= trial.watched;
  return {
    ...draft,
    save() {
      store.write(name, this);
    },
    drop() {
      store.remove(name);
    },
  };
}

function fresh(trial) {
  const now = Date.now();
  return {
    revision: trial.revision,
    step: "choice",
    choice: null,
    marks: null, // see marks.js
    watched: trial.watched,
    shown_at: now,
    watched_at: trial.watched ? now : null,
    chosen_at: null,
    replays: 0,
  };
}

/** A random UUID; crypto.randomUUID is missing on pages without https. */
export function uuid() {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  bytes[6] = (bytes[6] & 0x0f) | 0x40;
  bytes[8] = (bytes[8] & 0x3f) | 0x80;
  const hex = Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
  return hex.replace(/^(.{8})(.{4})(.{4})(.{4})(.{12})$/, "$1-$2-$3-$4-$5");
}
