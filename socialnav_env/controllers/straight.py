"""The controller that minds nobody: what going straight to the goal is worth."""

from __future__ import annotations

import numpy as np

from socialnav_env.config import CorridorConfig
from socialnav_env.controllers.controller import Controller
from socialnav_env.controllers.sight import Sight
from socialnav_env.controllers.steering import actions_for, pedestrian_parameters, targets
from socialnav_env.kernels import FloatArray


class StraightToGoal(Controller):
    """Goes at top speed straight to the intermittent goal, and from there to the end goal.

    Example:
        >>> import gymnasium as gym
        >>> import socialnav_env
        >>> from socialnav_env.controllers import StraightToGoal
        >>> env = gym.make("SocialCorridor-v0", num_humans=0)
        >>> robot = StraightToGoal(env.unwrapped.config)
        >>> observation, info = env.reset(seed=0)
        >>> while not info["success"]:
        ...     action, _ = robot.predict(observation)
        ...     observation, _, _, _, info = env.step(action)
        >>> info["intermittent"], round(info["spl"], 2) > 0.95
        (1.0, True)
    """

    def __init__(self, config: CorridorConfig) -> None:
        """Get to know the corridor; arguments and errors as `Controller`."""
        super().__init__(config)
        self._parameters = pedestrian_parameters(config)

    def act(self, sight: Sight) -> FloatArray:
        """(B, A) actions."""
        robot = sight.bodies[:, 0]
        ways = targets(sight, self._parameters) - robot[:, :2]
        lengths = np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-9)
        return actions_for(self.config.robot_speed * ways / lengths, robot[:, 2], self.config)
