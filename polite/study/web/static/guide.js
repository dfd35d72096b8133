/** The guide's two examples: each plays in a loop, with its window on the timeline. */

import { seconds } from "./controls.js";
import { mayMove, Player } from "./player.js";
import { lay } from "./timeline.js";

for (const example of document.querySelectorAll(".example")) show(example);

function show(example) {
  const part = (name) => example.querySelector(`[data-show="${name}"]`);
  const video = example.querySelector("video");
  const [steps, fps] = [Number(example.dataset.steps), Number(example.dataset.fps)];
  const marked = example.querySelector(".window");
  const player = new Player([video]);
  if (marked) lay(marked, Number(marked.dataset.start), Number(marked.dataset.size), steps);
  player.addEventListener("state", () => {
    part("play").textContent = player.playing ? "Pause" : "Play";
    part("glyph").textContent = player.playing ? "❚❚" : "▶";
  });
  player.addEventListener("step", () => {
    part("time").textContent = `${seconds(player.step, fps)} of ${seconds(steps, fps)}`;
    if (marked) part("head").style.left = `${(100 * (player.step + 0.5)) / steps}%`;
  });
  example.querySelector('[data-do="play"]').addEventListener("click", () => player.toggle());
  const { width, height } = video;
  player.load([{ video: video.getAttribute("src"), steps, width, height }], fps);
  if (mayMove()) player.play();
}
