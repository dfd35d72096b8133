/** Sentences for screen readers. */

/** Say a sentence once; the same sentence again is said again. */
export function announce(sentence) {
  const region = document.getElementById("live");
  region.textContent = "";
  requestAnimationFrame(() => {
    region.textContent = sentence;
  });
}
