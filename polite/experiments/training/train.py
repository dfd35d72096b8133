"""One training, from a method's name to a folder of results."""

from __future__ import annotations

import dataclasses
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from rich.progress import Progress

import socialnav_env  # noqa: F401 (registers the corridor)
from polite.analysis.learning_curve import learning_curve
from polite.dataset import save_feedback
from polite.experiments.run_folder import sole_run
from polite.experiments.runner import make_progress, moves
from polite.experiments.training.config import TrainConfig
from polite.experiments.training.env_settings import env_words, parse_env_settings
from polite.experiments.training.held_out import held_out_quality
from polite.experiments.training.judge import RATES, judge, outcomes
from polite.experiments.training.models import save_models
from polite.experiments.training.own_functions import (
    as_function,
    as_sampler,
    check_heard,
    check_sampler,
    checked,
    name_of,
)
from polite.experiments.training.remembered import remembered
from polite.experiments.training.settings import (
    adapt_preset,
    learning_config,
    pebble_settings,
    teacher_maker,
)
from polite.experiments.workers import one_torch_thread
from polite.files import read_json_object, sha256, write_atomically, write_json
from polite.methods.given import train_on_given
from polite.methods.history import Teacher
from polite.methods.pairs import PairSampler
from polite.methods.pebble import learn_pebble
from polite.methods.pebble_config import PEBBLE_METHODS
from polite.methods.preference_learning import (
    Follow,
    Learned,
    MakeEnv,
    MakeTeacher,
    Report,
    learn,
)
from polite.methods.presets import EnvPreset, preset_of
from polite.methods.setup import vector_sizes
from polite.plots.style import BLUE, STYLE, WIDTH, Look
from polite.plots.training import draw_training
from polite.policies.vec_env import check_spaces, make_vec_env
from polite.rewards.ensemble import RewardEnsemble
from polite.rewards.files import check_sizes, load_reward_model
from polite.rewards.network import RewardNet, raise_by
from polite.types import UNRELATED

RESULTS = "results.json"
UNDECIDED = (
    "the teacher {} expressed a preference each time: what is too little for it is a share of an "
    "average clip's true return, which is negative here (see average_return)"
)
UNSAID = "no answer said anything that {} learns from: the reward model has learned nothing"
ANSWERED = Path("data", "sessions")
"""What a teacher of the caller's own has said so far, in an unfinished training."""
CHECKPOINT = Path("models", "pebble.pt")
"""What PEBBLE goes on from; removed when it has finished."""
RECENT = 20
"""Finished episodes whose mean return stands beside the bar."""

Results = dict[str, Any]


def train(*, teacher: Any = "polite", sampler: Any = "uniform", **settings: Any) -> Path:
    """Train a policy: `run_train` with the fields of `TrainConfig` as keywords.

    Example:
        polite.train(out="runs/first", method="polite", queries=200, seed=0)

    Args:
        teacher: who answers: one of `TrainConfig.teacher`, or a function of your own (or an object
            with such a method `answer_queries`) from segments, pairs of them and a random generator
            to an `Answer` to each pair. The length of its highlights is the loss's to say
            (`highlight_length`). A training that is resumed knows it by its name alone: give the
            same.
        sampler: which pairs are asked about: one of `TrainConfig.sampler`, or a function of your
            own from a `polite.PairRequest` and the reward model so far to as many pairs as
            requested. The first session's are drawn uniformly.
        **settings: the other fields of `TrainConfig`; `env_settings` may be a dict of keywords.

    Returns:
        The path of `results.json`.

    Raises:
        PoliteError: as `run_train`.
        TypeError: if a keyword is unknown, or `out` is missing.
    """
    for name, value in settings.items():
        if name in ("out", "reward") and (name == "out" or value is not None):
            settings[name] = Path(value)
        elif name == "env_settings" and isinstance(value, Mapping):
            settings[name] = env_words(value)
        elif isinstance(value, np.generic | np.ndarray):  # kept as JSON, which knows neither
            settings[name] = value.tolist()
    own_teacher = own_sampler = None
    if isinstance(teacher, str):
        settings["teacher"] = teacher
    else:
        own_teacher = as_function(teacher)
    if isinstance(sampler, str):
        settings["sampler"] = sampler
    else:
        own_sampler = as_sampler(sampler)
    return run_train(TrainConfig(**settings), own_teacher, own_sampler)


def run_train(
    config: TrainConfig,
    own_teacher: Teacher | None = None,
    own_sampler: PairSampler | None = None,
) -> Path:
    """Train a policy and write everything into a folder.

    `results.json` is written last: a folder that has it is finished. The rest is `models/reward.pt`
    (unless the true reward paid), `models/policy.pt`, `data/` (where a teacher was asked) and
    `figures/learning_curve.png`.

    Args:
        config: what to train.
        own_teacher: answers in place of the one that the settings name.
        own_sampler: chooses the pairs in place of the one that the settings name.

    Returns:
        The path of `results.json`.

    Raises:
        PoliteError: if the folder is in use, a setting is impossible, the env is unknown, has no
            vectors or gives NaN, or the reward model's file is missing, damaged or another env's.
    """
    preset = adapt_preset(preset_of(config.env), config)
    make_env = _env_maker(config, preset)
    model = _given_model(config)
    identity, make_teacher = _identity(config), teacher_maker(config, preset)
    if own_teacher is not None:
        check_heard(config, own_teacher)
        identity["teacher"] = name_of(own_teacher)
        length = preset.training.highlight_length if config.uses("highlight_length") else None
        answers = remembered(checked(own_teacher, length), config.out / ANSWERED)
        make_teacher = lambda _: answers  # noqa: E731
    if own_sampler is not None:
        check_sampler(config, preset, own_sampler)
        identity["sampler"] = name_of(own_sampler)
    start = _learner(config, preset, make_env, make_teacher, own_sampler, model)
    with closing(make_env(1, 0)) as env:  # tried once, before a folder is made
        env.check_time_limit()
        vector_sizes(env)
        check_spaces(env)
        if model is not None:
            check_sizes(model, env.observation_space.shape, env.action_space.shape)
    with (
        sole_run(config.out, identity, config.resume),
        make_progress() as progress,
        one_torch_thread(),
    ):
        if _is_finished(config.out):
            progress.console.print(f"{config.out} is finished already; nothing to do")
        else:
            bar = _Bar(progress)
            learned = start(bar.report, bar.follow)
            _write_learned(config.out, learned)
            for remark in _remarks(config, learned):
                progress.console.print(remark, soft_wrap=True)
            bar.report(f"judging the policy over {config.evaluation_episodes} episodes", 1.0)
            judged = judge(make_env, learned.policy, config.evaluation_episodes, config.seed)
            if learned.reward is not None:
                bar.report("judging the reward model", 1.0)
            quality = held_out_quality(make_env, learned, config.seed)
            told = _results(learned, simulated=own_teacher is None and model is None)
            judgement = {"evaluation": judged, "reward_quality": quality}
            results = {"config": identity} | judgement | told
            _write_results(config.out, results)
            progress.console.print(_in_a_line(results), highlight=False, soft_wrap=True)
    return config.out / RESULTS


def _is_finished(folder: Path) -> bool:
    """Whether a training's results are there.

    Raises:
        PoliteError: if they are damaged: what was paid for in hours, or answered by people, is not
            made again unasked.
    """
    path = folder / RESULTS
    if path.exists():
        read_json_object(path, "delete it, and --resume (resume=True) trains again")
    return path.exists()


def _remarks(config: TrainConfig, learned: Learned) -> Iterator[str]:
    """What whoever asked for the training would want to know of its answers."""
    if _is_never_undecided(config, learned):
        yield UNDECIDED.format(config.teacher)
    if learned.feedback is None:
        return
    marks = any(a.positive or a.negative for a in learned.feedback.answers)
    preferences = any(a.preference != UNRELATED for a in learned.feedback.answers)
    said = {"highlights": marks, "preferences": preferences, "pebble": preferences}
    if not said.get(config.method, marks or preferences):
        yield UNSAID.format(config.method)


def _in_a_line(results: Results) -> str:
    """How the policy and its reward model did, for who waits for it."""
    judged, quality = results["evaluation"], results["reward_quality"]
    episodes = "1 episode" if judged["episodes"] == 1 else f"{judged['episodes']} episodes"
    text = f"true return {judged['return']:,.2f} over {episodes}"
    if quality and quality["late"]["pair_accuracy"] is not None:
        share = quality["late"]["pair_accuracy"]
        text += f"; r̂ puts {share:.0%} of fresh pairs of its clips in the true return's order"
    return text


def _is_never_undecided(config: TrainConfig, learned: Learned) -> bool:
    """Whether negative returns kept a teacher of B-Pref's from skipping or calling equal."""
    if config.teacher not in ("skip", "equal") or learned.feedback is None:
        return False
    average = learned.feedback.pool.returns.mean()
    expressed = all(answer.preferred is not None for answer in learned.feedback.answers)
    return bool(config.average_return is None and average < 0 and expressed)


def _given_model(config: TrainConfig) -> RewardNet | RewardEnsemble | None:
    """The finished reward model that was asked for, with its 0 where it was asked for."""
    if config.reward is None:
        return None
    model = load_reward_model(config.reward)
    raise_by(model, config.reward_offset)
    return model


def _learner(
    config: TrainConfig,
    preset: EnvPreset,
    make_env: MakeEnv,
    make_teacher: MakeTeacher,
    own_sampler: PairSampler | None,
    model: RewardNet | RewardEnsemble | None,
) -> Callable[[Report, Follow], Learned]:
    """The training, ready to start; whatever is wrong with its settings is said before it does."""
    seed = config.seed
    if config.method in PEBBLE_METHODS:
        pebble, checkpoint = pebble_settings(config, preset), config.out / CHECKPOINT
        return lambda report, follow: learn_pebble(
            make_env, make_teacher, pebble, seed, report, checkpoint, follow
        )
    if model is not None:
        return lambda report, follow: train_on_given(
            make_env, model, preset.ppo, config.steps, seed, report, follow
        )
    learning = learning_config(config, preset)
    if own_sampler is not None:
        learning = replace(learning, sampler=own_sampler)
    return lambda report, follow: learn(make_env, make_teacher, learning, seed, report, follow)


def _identity(config: TrainConfig) -> Results:
    """What makes the run what it is, wherever it is kept, and wherever its reward model lies."""
    settings = dataclasses.asdict(config)
    del settings["out"], settings["resume"]
    settings["reward"] = None if config.reward is None else f"sha256:{sha256(config.reward)}"
    return settings | {"env_settings": parse_env_settings(config.env_settings)}


def _env_maker(config: TrainConfig, preset: EnvPreset) -> MakeEnv:
    """How this run's envs are made."""
    return lambda count, seed: make_vec_env(config.env, count, seed, **preset.settings)


class _Bar:
    """Says what is happening, how far it is, and how the policy does meanwhile.

    In a log file, where no bar moves, there is a line for every tenth of the way.
    """

    def __init__(self, progress: Progress) -> None:
        self._progress, self._bar = progress, progress.add_task("beginning", total=1.0)
        self._does, self._tenths = "", -1

    def report(self, says: str, share: float) -> None:
        does = self._does if share < 1 else ""
        self._progress.update(self._bar, description=says + does, completed=share)
        console, tenths = self._progress.console, int(10 * share)
        if tenths > self._tenths and not moves(console):
            self._tenths = tenths
            console.print(f"{share:4.0%} {says}{does}", highlight=False, soft_wrap=True)

    def follow(self, episodes: Sequence[Mapping[str, float]]) -> None:
        if episodes:
            recent = fmean(episode["return"] for episode in episodes[-RECENT:])
            self._does = f", true return lately {recent:,.2f}"


def _results(learned: Learned, *, simulated: bool) -> Results:
    """What the training was and how it went.

    Who a teacher of one's own is, or whom a given reward model has learned from, nobody can tell.
    """
    told = dict.fromkeys(set(RATES) & set().union(*learned.episodes), 0.0)
    episodes = [{"step": e["step"]} | outcomes(told | e) for e in learned.episodes]
    answers = learned.feedback.answers if learned.feedback else []
    return {
        "simulated": simulated or None,
        "queries_asked": len(answers),
        "answers": {
            "no_preference": sum(answer.preferred is None for answer in answers),
            "positive": sum(answer.positive is not None for answer in answers),
            "negative": sum(answer.negative is not None for answer in answers),
        },
        "sessions": learned.sessions,
        "policy_steps": learned.policy_steps,
        "collection_steps": learned.collection_steps,
        "curve": learning_curve(episodes, learned.policy_steps),
    }


def _write_learned(folder: Path, learned: Learned) -> None:
    """Write models and data, before anything else can go wrong."""
    save_models(folder / "models", learned.policy, learned.reward)
    if learned.feedback is not None:
        save_feedback(folder / "data", learned.feedback)


def _write_results(folder: Path, results: Results) -> None:
    """Write the figure, and at last the results."""
    draw_learning_curve(folder / "figures" / "learning_curve.png", results)
    write_json(folder / RESULTS, results)
    (folder / CHECKPOINT).unlink(missing_ok=True)
    shutil.rmtree(folder / ANSWERED, ignore_errors=True)  # data/ has them all


def draw_learning_curve(path: Path, results: Results) -> None:
    """Draw the true return, and the success rate where there is one, against policy steps."""
    curve = results["curve"]
    panels = {"return": "true return", "success_rate": "success rate"}
    shown = [name for name in panels if name in curve]
    look = Look(results["config"]["method"], BLUE, "-", "o")
    with rc_context(STYLE):
        figure = Figure(figsize=(WIDTH, 2.8))
        axes = figure.subplots(1, max(1, len(shown)), squeeze=False)[0]
        for ax, name in zip(axes, shown, strict=False):
            draw_training(ax, curve["steps"], curve[name], results["sessions"], look, panels[name])
            if name != "return":
                ax.set_ylim(-0.02, 1.02)
        axes[0].set_title("{method}, {env}, seed {seed}".format(**results["config"]))
        if shown and results["sessions"]:
            axes[0].legend(loc="lower right")
        write_atomically(path, figure.savefig)
