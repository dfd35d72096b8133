/** Messages above the step: one that stays, and one while something is not stored yet. */

const notice = document.getElementById("notice");
const pending = document.getElementById("pending");

/** Show a message until `clearNotice`. */
export function showNotice(text) {
  notice.textContent = text;
  notice.hidden = false;
}

export function clearNotice() {
  notice.hidden = true;
  notice.textContent = "";
}

/** Say that something waits for the server; `hurry` tries again at once. */
export function showPending(what, problem, seconds, hurry) {
  const text = document.createElement("p");
  const button = document.createElement("button");
  text.textContent = `${what} ${problem.message} Trying again in ${Math.ceil(seconds)} s.`;
  Object.assign(button, { type: "button", textContent: "Try now" });
  button.addEventListener("click", hurry);
  pending.replaceChildren(text, button);
  pending.hidden = false;
}

export function clearPending() {
  pending.hidden = true;
  pending.replaceChildren();
}
