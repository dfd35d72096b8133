"""Make an animated GIF of each scenario, driven by a reference controller.

    python examples/make_gifs.py                         # those of the README, into assets/gifs
    python examples/make_gifs.py --out gifs --only crowded --width 800

With `--still assets/corridor.png` it draws the README's picture instead.
"""

import argparse
from pathlib import Path

import gymnasium as gym
from PIL import Image

from polite.files import write_atomically
from socialnav_env.controllers import CONTROLLERS

SPACE, FORCES, RAYS = ("personal_space",), ("forces",), ("rays",)
FILMS = {  # controller, seed, what is laid over the picture, keywords of the env
    "paper": ("social-force", 0, SPACE, {"scenario": "paper"}),
    "empty": ("social-force", 9, ("reward",), {"scenario": "empty"}),
    "crowded": ("dynamic-window", 9, FORCES, {"scenario": "crowded"}),
    "doorway": ("dynamic-window", 0, RAYS, {"scenario": "doorway"}),
    "group": ("social-force", 8, SPACE, {"walking": "group", "num_humans": 8}),
    "queue": ("social-force", 0, SPACE, {"walking": "queue", "num_humans": 8}),
}
EVERY, COLOURS, FPS, LAST_MILLISECONDS, STILL = 3, 64, 10, 1500, 80
"""Every third step is shown, ten a second: three times as fast as it is."""


def film(width, controller, seed, overlays, settings):
    """An episode's frames, and whether it reached the end goal."""
    env = gym.make("SocialCorridor-v0", render_mode="rgb_array", render_width=width,
                   overlays=(*overlays, "trajectory"), **settings)  # fmt: skip
    robot = CONTROLLERS[controller](env.unwrapped.config)
    observation, info = env.reset(seed=seed)
    frames, ended = [env.render()], False
    while not ended:
        observation, _, terminated, truncated, info = env.step(robot.predict(observation)[0])
        ended = terminated or truncated
        if ended or round(info["time_to_goal"] / env.unwrapped.dt) % EVERY == 0:
            frames.append(env.render())
    env.close()
    return [Image.fromarray(frame) for frame in frames], bool(info["success"])


def write_gif(path: Path, frames: list[Image.Image]) -> None:
    """A small file: one palette for all frames, no dithering, and only what has changed."""
    shown = frames[:: max(len(frames) // 8, 1)]
    together = Image.new("RGB", (shown[0].width, shown[0].height * len(shown)))
    for k, frame in enumerate(shown):
        together.paste(frame, (0, k * frame.height))
    palette = together.quantize(COLOURS, Image.Quantize.FASTOCTREE)
    first, *rest = (frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
    pause = [1000 // FPS] * len(rest) + [LAST_MILLISECONDS]
    film = {"save_all": True, "append_images": rest, "duration": pause, "loop": 0}
    write_atomically(path, lambda temporary: first.save(temporary, "GIF", **film))


def main(out: Path, only: list[str], width: int, still: Path | None) -> None:
    if still:  # a moment of the default scene with the default overlays
        moment = film(960, *FILMS["paper"])[0][STILL]
        write_atomically(still, lambda temporary: moment.save(temporary, "PNG"))
        return
    for name in only:
        frames, success = film(width, *FILMS[name])
        write_gif(path := out / f"{name}.gif", frames)
        size = path.stat().st_size / 1000
        print(f"{path}: {len(frames)} frames, {size:.0f} kB, success {success:.0f}", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    gifs = Path(__file__).parents[1] / "assets" / "gifs"
    parser.add_argument("--out", type=Path, default=gifs, help="folder")
    parser.add_argument("--only", nargs="+", choices=FILMS, default=[*FILMS], metavar="SCENARIO")
    parser.add_argument("--width", type=int, default=640, help="of the pictures [px]")
    parser.add_argument("--still", type=Path, help="draw only a picture, 960 px wide, here")
    main(**vars(parser.parse_args()))
