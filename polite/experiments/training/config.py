"""The settings of one training; the command line is made from them. Imports nothing heavy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from math import inf, isfinite
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Final, Literal, get_args, get_origin, get_type_hints

from polite.experiments.training.env_settings import parse_env_settings
from polite.types import InvalidValueError

_ON_HIGHLIGHTS = (
    "highlights",
    "highlight_length",
    "highlight_decay",
    "marks",
    "highlights_missed",
    "highlights_wrong_sign",
    "highlights_shifted",
)
_ON_ANSWERS = (
    "teacher",
    "schedule",
    "sessions",
    "epochs",
    "sampler",
    "segment_length",
    "show_ends",
    "loss",
    *_ON_HIGHLIGHTS,
)
_UNHEARD = {
    "ground-truth": (*_ON_ANSWERS, "reward_net", "members", "normalise", "reward_offset"),
    "sac": (*_ON_ANSWERS, "reward_net", "reward_offset"),
    "untrained": _ON_ANSWERS,
    "given": (*_ON_ANSWERS, "reward_net", "members", "normalise"),
    "preferences": _ON_HIGHLIGHTS,
    "pebble": _ON_HIGHLIGHTS,
    "highlights": ("loss",),
}
"""What each method never looks at. The queries are not here, so that one line of a script serves
every method."""
_EXPECTED: Final[Mapping[Any, tuple[Any, str]]] = {
    bool: (bool, "true or false"),
    str: (str, "a text"),
    int: (int, "a whole number"),
    float: ((int, float), "a number"),
}
"""Of what types a setting's value may be, in words too; to Python, true is a number as well."""
_PEBBLE: Final = ("pebble", "polite-pebble", "sac")
"""The methods whose policy is SAC."""
MOST_SESSIONS: Final = 50
"""That begin before a training ends, one every fiftieth of it (`polite.methods.schedules`)."""
_LEAST = {
    "queries": 0,
    "steps": 1,
    "seed": 0,
    "members": 1,
    "segment_length": 1,
    "evaluation_episodes": 1,
}


@dataclass(frozen=True, kw_only=True)
class TrainConfig:
    """Train a policy from the answers of a simulated teacher, by one of the methods.

    Writes results.json, models/, data/ and figures/ into a folder.
    """

    out: Path
    """Folder for everything; new, unless --resume."""
    env: str = "SocialCorridor-v0"
    """Id of any Gymnasium env with vectors for observations and continuous actions; one of your own
    as MODULE:ID, the module that registers it before a colon."""
    env_settings: tuple[str, ...] = ()
    """Keywords of the env as NAME=VALUE, the value in JSON, such as terminate_when_unhealthy=false
    or max_episode_steps=500."""
    method: Literal[
        "polite",
        "preferences",
        "highlights",
        "untrained",
        "ground-truth",
        "given",
        "pebble",
        "polite-pebble",
        "sac",
    ] = "polite"
    """polite: preferences and highlights; preferences, highlights: one of them alone; untrained: a
    random reward model; ground-truth: the env's own reward; given: the reward model of --reward,
    as it is; all by PPO. pebble: preferences, by PEBBLE (SAC, relabelled replay, three reward
    models); polite-pebble: highlights as well; sac: its SAC on the env's own reward."""
    reward: Path | None = None
    """File of a reward model that is finished already, learned from people or by another run
    (models/reward.pt), for --method given."""
    reward_offset: float = 0.0
    """Added to what the reward model pays for every step; with --method given, on top of what it
    was raised by where it comes from. Comparisons of clips of one length leave this open; where the
    env ends episodes early, a reward model below 0 pays for ending them. With --normalise, 2 puts 0
    two standard deviations below the average step of the clips so far. Not for PEBBLE."""
    preset: Literal["fast", "paper"] = "fast"
    """fast: highlights as a choice, a small reward model, PPO for a laptop; paper: the paper's
    highlights, reward model with dropout and PPO, all of which take far longer."""
    queries: int = 200
    """Pairs of clips that the teacher is asked about."""
    steps: int = 200_000
    """Steps on which the policy is trained, in whole rollouts (PPO's learning rate falls to 0 with
    the last of them, so that one alone trains nothing); those spent on collecting clips come on
    top."""
    seed: int = 0
    """Everything random follows from it."""
    learning_rate: float | None = None
    """The policy's step size; the env's own if not given, 0.0005 for PEBBLE and sac. PPO's is that
    of the beginning: it falls to 0, but under the paper's settings for HalfCheetah and Walker2d."""
    teacher: Literal["polite", "oracle", "equal", "skip", "mistake", "myopic", "stochastic"] = (
        "polite"
    )
    """Who answers. polite: the paper's, who reverses 10% of the preferences and skips ties; the
    others are B-Pref's, of whom oracle makes no mistakes. Where all of them place highlights goes
    with --highlights."""
    rationality: float | None = None
    """β of the teacher stochastic, per unit of true return; 1 if not given."""
    average_return: float | None = None
    """True return of an average clip, of which the teachers skip and equal take a tenth for too
    little. If not given it is taken from the clips that are asked about, and while that is negative
    nobody skips or calls equal."""
    schedule: Literal["sessions", "decaying", "up-front"] = "sessions"
    """When the teacher is asked. sessions: ten in the first fifth of the training; decaying: a
    quarter before it, the rest ever more rarely until its end; up-front: before it."""
    sessions: int | None = None
    """How many there are under --schedule sessions, one every fiftieth of the training (so at most
    50; each waits for the end of a rollout), and of PEBBLE, one every 20,000 steps (in a training
    shorter than 250,000 sooner, in proportion). If not given ten, or as many as there is time for.
    """
    epochs: Literal["released", "few"] = "released"
    """How long the reward model is trained. released: 200 passes over the answers after the first
    session and 50 after each later one, as the authors' release; few: an eighth of that, which on
    HalfCheetah led to better policies with 800 queries and 1,000,000 steps, and in two runs to
    worse ones with 200 and 200,000. PEBBLE has its own number."""
    sampler: Literal["uniform", "disagreement", "entropy", "k-centre", "disputed-k-centre"] = (
        "uniform"
    )
    """Which pairs the teacher is asked about, from the second session on. disagreement and
    disputed-k-centre need --members 2 or more. PEBBLE always asks what is disputed."""
    reward_net: tuple[int, ...] = ()
    """Units of each hidden layer of a reward model, without dropout; the preset's network if not
    given (fast: 32 32; paper: 256 256 256 with dropout), PEBBLE's (256 256 256) for PEBBLE."""
    members: int = 1
    """Reward models, of which the mean pays the policy; PEBBLE always has three."""
    normalise: bool = False
    """Whether r̂ is shifted and scaled after each session, to mean 0 and spread 1 over the clips so
    far. Not for PEBBLE."""
    validation_share: float = 0.0
    """Share of the answers that is held out, so that the reward model's training stops early; it
    does not while fewer than ten of those say anything. Not for PEBBLE."""
    segment_length: int = 50
    """Steps of a clip; an episode that is shorter is one clip. Not for PEBBLE."""
    show_ends: bool = False
    """Whether clips may be cut short where the env ended an episode early, so that answers say what
    an end costs. Not for PEBBLE."""
    loss: Literal["pairwise", "released"] = "pairwise"
    """What a preference says: Eq. 2 of the paper, or the softmax over the minibatch that the
    authors' release has in its place."""
    highlights: str | None = None
    """What a highlight says: choice (the preset fast's), paper (the preset paper's), paper-summed,
    target, margin, segment, rival or choice-rival. Under paper the teacher marks what passes fixed
    thresholds (the release's on HalfCheetah and Walker2d, elsewhere the env's own) and α is the
    paper's; under every other form it marks what is unusual among the clips (above the 80%
    quantile, below the 20%) and α is 1."""
    highlight_length: int | None = None
    """L, steps that a highlight reaches back; the env's own if not given."""
    highlight_decay: float | None = None
    """λ, what a step of it counts relative to the next one; the env's own if not given."""
    marks: Literal["labelled", "true-winner"] = "labelled"
    """On which clip highlights lie when a preference was reversed by mistake: on the one that was
    named the better, or on the one that is."""
    highlights_missed: float = 0.0
    """How often the teacher forgets a highlight that it would have given."""
    highlights_wrong_sign: float = 0.0
    """How often it marks the good as bad and the bad as good."""
    highlights_shifted: float = 0.0
    """How often a highlight lies up to 5 steps beside its moment."""
    evaluation_episodes: int = 100
    """Whole episodes on which the finished policy is judged by the true reward."""
    resume: bool = False
    """Take a folder that was begun with the same settings; an unfinished training starts over, but
    PEBBLE's goes on from its last session."""

    def __post_init__(self) -> None:
        """Check names and numbers.

        Raises:
            InvalidValueError: naming the one that is unknown or out of its range.
        """
        for name, kind in get_type_hints(type(self)).items():
            self._check_type(name, kind)
            known = get_args(kind) if get_origin(kind) is Literal else ()
            if known and getattr(self, name) not in known:
                raise self._unfit(name, f"expected one of {', '.join(known)}")
        if not isinstance(self.reward_net, Sequence) or not all(
            type(units) is int and units >= 1 for units in self.reward_net
        ):
            raise self._unfit("reward_net", "expected a list of whole numbers of at least 1")
        for name, least in _LEAST.items():
            if getattr(self, name) < least:
                raise self._unfit(name, f"expected at least {least}")
        if self.learning_rate is not None and not 0 < self.learning_rate < inf:
            raise self._unfit("learning_rate", "expected a finite number above 0")
        if not isfinite(self.reward_offset):
            raise self._unfit("reward_offset", "expected a finite number")
        for name in ("highlights_missed", "highlights_wrong_sign", "highlights_shifted"):
            if not 0 <= getattr(self, name) <= 1:
                raise self._unfit(name, "expected a share in [0, 1]")
        parse_env_settings(self.env_settings)
        self._check_heard()
        self._check_schedule()
        self._check_teacher()
        self._check_reward_model()
        self._check_given()
        if self.method in _PEBBLE:
            self._check_pebble()

    def _check_type(self, name: str, kind: Any) -> None:
        """A word where a number is expected would be found hours later.

        Raises:
            InvalidValueError: naming the setting.
        """
        value = getattr(self, name)
        allowed = get_args(kind) if isinstance(kind, UnionType) else (kind,)
        if allowed[0] not in _EXPECTED or (value is None and NoneType in allowed):
            return
        fits, words = _EXPECTED[allowed[0]]
        if not isinstance(value, fits) or isinstance(value, bool) != (allowed[0] is bool):
            raise self._unfit(name, f"expected {words}")

    def _check_heard(self) -> None:
        """What the method never looks at would go unheard.

        Raises:
            InvalidValueError: naming it.
        """
        defaults = {field.name: field.default for field in fields(self)}
        for name, default in defaults.items():
            if getattr(self, name) != default and not self.uses(name):
                raise self._unfit(name, f"{self.method} has no use for it; leave it out")

    def _check_schedule(self) -> None:
        """Only one schedule leaves the number of sessions open; up front nothing is known.

        Raises:
            InvalidValueError: if sessions that cannot be held, or pairs that need a reward model,
                were asked for.
        """
        if self.sessions is not None and self.schedule != "sessions":
            raise self._unfit("sessions", "only for --schedule sessions")
        most = min(self.queries, inf if self.method in _PEBBLE else MOST_SESSIONS)
        if self.sessions is not None and not 1 <= self.sessions <= most:
            raise self._unfit("sessions", f"expected 1 to {most}, each with a query")
        if self.schedule == "up-front" and self.sampler != "uniform":
            raise self._unfit(
                "sampler",
                "expected uniform where everything is asked up front, since nothing is learned "
                "before",
            )

    def uses(self, name: str) -> bool:
        """Whether the method looks at a setting."""
        return name not in _UNHEARD.get(self.method, ())

    def _check_teacher(self) -> None:
        """A number that this teacher does not have would go unheard.

        Raises:
            InvalidValueError: naming it, or one that is out of its range.
        """
        for name, teachers in (
            ("rationality", ("stochastic",)),
            ("average_return", ("skip", "equal")),
        ):
            value = getattr(self, name)
            if value is not None and not 0 <= value < inf:
                raise self._unfit(name, "expected a number of at least 0")
            if value is not None and self.teacher not in teachers:
                raise self._unfit(name, f"only for --teacher {' and '.join(teachers)}")

    def _check_reward_model(self) -> None:
        """Without preferences nothing can be held out.

        Raises:
            InvalidValueError: if something should be.
        """
        if self.validation_share and self.method not in ("polite", "preferences"):
            raise self._unfit(
                "validation_share", "only for methods that learn from preferences by PPO"
            )

    def _check_given(self) -> None:
        """A finished reward model and its method come together.

        Raises:
            InvalidValueError: if one comes alone.
        """
        if (self.reward is None) == (self.method == "given"):
            raise self._unfit(
                "reward",
                "expected the file of a reward model with --method given, and with no other",
            )

    def _check_pebble(self) -> None:
        """PEBBLE brings its own times, pairs and models; a wish for others would go unheard.

        Raises:
            InvalidValueError: naming what cannot be chosen.
        """
        for name, own in (
            ("schedule", "sessions"),
            ("epochs", "released"),
            ("sampler", "uniform"),
            ("members", 1),
            ("normalise", False),
            ("reward_offset", 0.0),
            ("segment_length", 50),
            ("show_ends", False),
        ):
            if getattr(self, name) != own:
                raise self._unfit(name, "PEBBLE has its own; leave it out")
        if self.preset == "paper":
            raise self._unfit("preset", "the paper has no numbers for PEBBLE")

    def _unfit(self, name: str, why: str) -> InvalidValueError:
        """The error that names one setting, and what was seen of it."""
        return InvalidValueError(f"{name}: {why}, got {getattr(self, name)!r}")
