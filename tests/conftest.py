import os

import gymnasium as gym
import pytest
from hypothesis import HealthCheck, settings

# No test may depend on how busy the machine is.
settings.register_profile(
    "any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("any machine")


@pytest.fixture
def make_mujoco(tmp_path, monkeypatch):
    """`gym.make` for MuJoCo envs in a folder of their own.

    MuJoCo 4 warns about Gymnasium's Walker2d model and writes MUJOCO_LOG.TXT where it runs.
    """
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MUJOCO_GL", os.environ.get("MUJOCO_GL", "egl"))
    made = []

    def make(name, **settings):
        made.append(gym.make(name, **settings))
        return made[-1]

    yield make
    for env in made:
        env.close()
