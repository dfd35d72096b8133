/** Which part of the page is shown, and where the focus is. */

/** Show one section and hide the others; the focus goes to its heading. */
export function showSection(id, focus = true) {
  for (const section of document.querySelectorAll("#study > section"))
    section.hidden = section.id !== id;
  freeze(false);
  const heading = document.getElementById(id).querySelector("h1");
  if (focus) heading.focus();
}

/** While an answer is on its way nothing can be changed; the heading can still be read. */
export function freeze(on) {
  for (const part of document.querySelectorAll("#study > section > :not(h1)")) part.inert = on;
}

/** Whether an answer is on its way. */
export const frozen = () => Boolean(document.querySelector("#study > section > [inert]"));

/** A last page, with a button that reloads. */
export function showEnd(title, message) {
  const ended = document.getElementById("ended");
  ended.querySelector('[data-show="title"]').textContent = title;
  ended.querySelector('[data-show="message"]').textContent = message;
  ended.querySelector("button").addEventListener("click", () => location.reload());
  document.getElementById("progress").hidden = true;
  document.getElementById("keys").hidden = true;
  showSection("ended");
}

/** "3 of 22" with its bar. */
export function showProgress(trial, title) {
  const box = document.getElementById("progress");
  const phase = trial.phase === "practice" ? "Practice" : "Comparison";
  const count = `${trial.number} of ${trial.of}`;
  box.hidden = false;
  box.querySelector('[data-show="phase"]').textContent = phase;
  box.querySelector('[data-show="count"]').textContent = count;
  Object.assign(box.querySelector("progress"), { max: trial.of, value: trial.number - 1 });
  document.title = `${phase} ${count} – ${title}`;
}
