/** Single-key shortcuts; they never take a key from the control that has the focus. */

const MOVES = ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End", "PageUp", "PageDown"];
const PRESSES = [" ", "Enter"];

/**
 * Call `act(key, event)` for each key that is free; it returns true when it used the key.
 * Letters come in lower case, Ctrl+Z as "undo". The checkbox `box` switches all of them off.
 */
export function listen(box, act) {
  document.addEventListener("keydown", (event) => {
    if (event.defaultPrevented || event.isComposing || !box.checked) return;
    const key = nameOf(event);
    if (key === null || taken(event.target, key)) return;
    if (act(key, event)) event.preventDefault();
  });
}

function nameOf({ key, ctrlKey, metaKey, altKey }) {
  if (ctrlKey || metaKey) return key.toLowerCase() === "z" ? "undo" : null;
  if (altKey) return null;
  return key.length === 1 ? key.toLowerCase() : key;
}

/** Whether the focused element has a use of its own for the key. */
function taken(target, key) {
  const own = target.closest("input, textarea, select, button, a, summary");
  if (!own) return false;
  if (own.matches("button, a, summary")) return PRESSES.includes(key);
  if (own.matches('[type="range"], [type="radio"]')) return MOVES.includes(key) || key === " ";
  if (own.matches('[type="checkbox"]')) return PRESSES.includes(key);
  return true;
}
