"""Writes docs/SocialCorridor-v0.md from the code's own descriptions: python docs/make.py."""

import ast
import dataclasses
import inspect
import textwrap
from pathlib import Path

from socialnav_env import CorridorConfig, SocialCorridorEnv, SocialCorridorVectorEnv, config
from socialnav_env.controllers import CONTROLLERS
from socialnav_env.metrics import METRICS, SOURCES
from socialnav_env.wrappers.table import DEFINITIONS

PAGE = Path(__file__).with_name("SocialCorridor-v0.md")
EXAMPLES = {
    "paper": 'scenario="paper"',
    "empty": 'scenario="empty"',
    "crowded": 'scenario="crowded"',
    "doorway": 'scenario="doorway"',
    "group": 'walking="group", num_humans=8',
    "queue": 'walking="queue", num_humans=8',
}
"""Animation -> the keywords of what it shows."""


def said_of_fields():
    """Field of CorridorConfig -> its docstring, on one line."""
    (body,) = ast.parse(textwrap.dedent(inspect.getsource(CorridorConfig))).body
    said = {}
    for field, text in zip(body.body, body.body[1:], strict=False):
        if isinstance(field, ast.AnnAssign) and isinstance(text, ast.Expr):
            said[field.target.id] = " ".join(text.value.value.split())
    return said


def allowed(metadata):
    """What a field may hold, in words."""
    if "choices" in metadata:
        return ", ".join(f'`"{word}"`' for word in metadata["choices"])
    if "low" in metadata:
        return f"{metadata['low']:g} to {metadata['high']:g}"
    return "`True`, `False`"


def keyword_rows():
    """A table row for each keyword."""
    said = said_of_fields()
    for field in dataclasses.fields(CorridorConfig):
        varies = "yes" if field.metadata["varies"] else ""
        value = f"{field.default:.4g}" if isinstance(field.default, float) else f"{field.default}"
        may = allowed(field.metadata)
        yield f"| `{field.name}` | {value} | {may} | {varies} | {said[field.name]} |"


def told(thing):
    """A docstring without its example."""
    return inspect.getdoc(thing).partition("Example:")[0].strip()


def scenario_rows():
    """A table row for each named scenario."""
    for name, settings in config.SCENARIOS.items():
        words = ", ".join(f"`{key}={value!r}`" for key, value in settings.items())
        yield f"| `{name}` | {words or 'the defaults: the scene of the POLITE paper'} |"


def page():
    """The whole page."""
    description = inspect.cleandoc(SocialCorridorEnv.__doc__)
    pictures = "\n".join(
        f"| `{words}` | ![{name}](../assets/gifs/{name}.gif) |" for name, words in EXAMPLES.items()
    )
    metrics = "\n".join(
        f"| `{name}` | {text.replace('|', '&#124;')} |"  # a bar would end the cell
        for name, text in METRICS.items()
    )
    sums = "\n".join(
        f"| `{name}` | {text} |" for name, text in DEFINITIONS.items() if name not in METRICS
    )
    sources = "\n".join(f"- {name}: {text}" for name, text in SOURCES.items())
    controllers = "\n".join(
        f"| `{robot.__name__}` | {' '.join(told(robot).split())} |"
        for robot in CONTROLLERS.values()
    )
    many = told(SocialCorridorVectorEnv)
    rows = "\n".join
    return f"""# SocialCorridor-v0

<!-- Written by docs/make.py from the code; change the docstrings, not this page. -->

| | |
|---|---|
| Import | `import socialnav_env; gymnasium.make("SocialCorridor-v0")` |
| Many at once | `gymnasium.make_vec("SocialCorridor-v0", num_envs=256)` |

{description}

## Scenarios

`scenario=` sets other keywords; those given beside it win.

| Scenario | Keywords |
|---|---|
{rows(scenario_rows())}

Three times real speed, driven by `SocialForceRobot` (crowded and doorway: `DynamicWindow`); dashed
rings are personal space, blue lines the rays, arrows the social forces, bars the reward terms.

| | |
|---|---|
{pictures}

## Keywords

"Varies" says that `reset(options={{...}})` may set it too: to a value, a pair `(low, high)` drawn
from uniformly at each start of an episode, or a list of values to choose from. Options stay in
force until a reset brings others; `options={{"defaults": True}}` returns to the keywords.

| Keyword | Default | Allowed | Varies | |
|---|---|---|---|---|
{rows(keyword_rows())}

## Social metrics

Running values in `info` at each step; at an episode's end they sum it up. The unit comes last.

| Key | Definition |
|---|---|
{metrics}

`socialnav_env.wrappers.EpisodeMetrics` adds these at an episode's end, and `SocialMetrics` (for a
vector env `VectorSocialMetrics`) makes a table of means with 95% intervals over episodes, as
`socialnav_env.evaluation.evaluate(policy, episodes=200, scenario="crowded")` does in one call:

| Key | Definition |
|---|---|
{sums}

{sources}

## Many corridors at once

`gymnasium.make_vec("SocialCorridor-v0", num_envs=256, autoreset_mode="SameStep")`: all keywords
above, `max_episode_steps`, and `render_envs`, the corridors that `render()` draws (`render_tiled()`
makes one picture of them).

{many}

## Reference controllers

In `socialnav_env.controllers`, with the `predict` of stable-baselines3:
`StraightToGoal(env.unwrapped.config).predict(observation)`. A controller has to know the config of
the env that it drives: `evaluate(StraightToGoal(CorridorConfig.from_keywords(scenario="crowded")),
episodes=200, scenario="crowded")`, with `CorridorConfig` of `socialnav_env.config`.

| Controller | |
|---|---|
{controllers}

## Drive it

`python -m socialnav_env.play --scenario doorway --out drives` opens a window: arrow keys drive, and
every episode is recorded as a trajectory that replays exactly, and as a video if asked. `--help`
tells more.
"""


if __name__ == "__main__":
    PAGE.write_text(page())
    print(PAGE)
