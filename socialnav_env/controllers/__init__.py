"""Reference controllers to compare with, as policies with the `predict` of stable-baselines3.

Each is made from the corridor's config and maps observations ("both" or "state") to actions,
without memory: one observation or a batch of them.
"""

from socialnav_env.controllers.controller import Controller
from socialnav_env.controllers.dynamic_window import DynamicWindow
from socialnav_env.controllers.social_force import SocialForceRobot
from socialnav_env.controllers.straight import StraightToGoal

__all__ = ["CONTROLLERS", "Controller", "DynamicWindow", "SocialForceRobot", "StraightToGoal"]

CONTROLLERS: dict[str, type[Controller]] = {
    "straight": StraightToGoal,
    "social-force": SocialForceRobot,
    "dynamic-window": DynamicWindow,
}
"""Short name -> controller."""
