"""A small finished study, made once and copied for each test."""

import shutil

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from polite.dataset import Feedback, save_feedback
from polite.rollouts import collect
from polite.samplers import uniform_pairs
from polite.segments import cut_segments
from polite.study.clips import prepare_clips
from polite.study.folder import StudyFolder

STUDY = """
title = "How a robot should move"
contact = "Ada Example, ada@example.org"
env = "socialnav_env:SocialCorridor-v0"
env_settings = { render_width = 96 }
participants = 2
comparisons = 3
repeated = 1
mirrored = 1
highlight_length = 3

[consent]
version = "1"
text = "You see clips of a robot.\\n\\nYou can stop at any time."

[guide]
text = "Look at how the robot treats people."
good = { segment = 0, start = 2, text = "It keeps its distance." }
bad = { segment = 1, start = 5, text = "It drives into somebody." }

[[practice]]
first = 0
second = 1
expected = "first"
explanation = "The second one drives into somebody."

[[questions]]
name = "demanding"
text = "How demanding was it?"
kind = "scale"

[[questions]]
name = "group"
text = "Which group are you in?"
kind = "choice"
options = ["one", "another"]

[[questions]]
name = "comment"
text = "Anything else?"
kind = "text"
required = false
"""
"""The design: 2 participants a condition, 1 practice pair, 3 comparisons and 2 catch pairs."""
ENV = "socialnav_env:SocialCorridor-v0"
SEGMENTS, STEPS = 6, 12


def make_pool() -> Feedback:
    """Segments of a corridor that is walked through at random, and pairs of them."""
    rng = np.random.default_rng(0)
    env = gym.make_vec(ENV, 2, max_episode_steps=60, autoreset_mode=AutoresetMode.SAME_STEP)

    def act(observations):
        return rng.uniform(-1, 1, (len(observations), 2)).astype(np.float32)

    pool = cut_segments(collect(env, act, 60, 0), STEPS, SEGMENTS, rng)
    env.close()
    return Feedback(pool, uniform_pairs(6, rng, pool))


@pytest.fixture(scope="session")
def study_template(tmp_path_factory):
    """A study's folder that nobody may change."""
    path = tmp_path_factory.mktemp("study") / "template"
    feedback = make_pool()
    save_feedback(path / "pool", Feedback(feedback.pool, feedback.queries))
    (path / "study.toml").write_text(STUDY, encoding="utf-8")
    folder = StudyFolder(path)
    prepare_clips(path, folder.design, folder.feedback)
    assert folder.secrets.session_key  # made now, so that every copy has them
    folder.check()
    return path


@pytest.fixture
def study_folder(study_template, tmp_path):
    """A `StudyFolder` of the test's own: six segments of 12 steps, clips and secrets made."""
    path = tmp_path / "study"
    shutil.copytree(study_template, path)
    return StudyFolder(path)
