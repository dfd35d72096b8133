/** What most people answer, after a practice comparison. */

const NAMES = { left: "A (left)", right: "B (right)" };

export class FeedbackStep {
  /** @param {() => void} go called when the participant goes on */
  constructor(root, go) {
    this.root = root;
    this.heading = root.querySelector("h1");
    root.querySelector('[data-do="continue"]').addEventListener("click", go);
  }

  open({ correct, expected, text }) {
    const part = (name) => this.root.querySelector(`[data-show="${name}"]`);
    part("verdict").textContent = correct ? "✓ Most people agree" : "Most people answer differently";
    part("expected").textContent = `Most people prefer ${NAMES[expected]}.`;
    part("text").replaceChildren(...text.split(/\n\s*\n/).map(paragraph));
  }

  close() {}

  key() {
    return false;
  }
}

function paragraph(text) {
  const element = document.createElement("p");
  element.textContent = text.trim();
  return element;
}
