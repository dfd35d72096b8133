"""Writes docs/SocialCorridor-v0.md from the code's own descriptions: python docs/make.py."""

import ast
import dataclasses
import inspect
import textwrap
from pathlib import Path

from socialnav_env import CorridorConfig, SocialCorridorEnv, config
from socialnav_env.metrics import METRICS

PAGE = Path(__file__).with_name("SocialCorridor-v0.md")
EXAMPLES = ("paper", "empty", "crowded", "doorway", "group", "queue")
"""Scenarios and walking styles that have an animation."""


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
        yield f"| `{field.name}` | {value} | {allowed(field.metadata)} | {varies} | {said[field.name]} |"


def scenario_rows():
    """A table row for each named scenario."""
    for name, settings in config.SCENARIOS.items():
        words = ", ".join(f"`{key}={value!r}`" for key, value in settings.items())
        yield f"| `{name}` | {words or 'the defaults: the scene of the POLITE paper'} |"


def page():
    """The whole page."""
    description = inspect.cleandoc(SocialCorridorEnv.__doc__)
    pictures = "\n".join(
        f"| `{name}` | ![{name}](../assets/gifs/{name}.gif) |" for name in EXAMPLES
    )
    metrics = "\n".join(f"| `{name}` | {text} |" for name, text in METRICS.items())
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

| | Driven by a reference controller |
|---|---|
{pictures}

## Keywords

"Varies" says that `reset(options={{...}})` may set it too: to a value, a pair `(low, high)` drawn
from uniformly at each start of an episode, or a list of words or switches to choose from. Options
stay in force until a reset brings others; `options={{}}` returns to the keywords.

| Keyword | Default | Allowed | Varies | |
|---|---|---|---|---|
{rows(keyword_rows())}

## Social metrics

Running values in `info` at each step; at an episode's end they sum it up.

| Key | Definition |
|---|---|
{metrics}
"""


if __name__ == "__main__":
    PAGE.write_text(page())
    print(PAGE)
