"""The stub envs, known to Gymnasium as `registered_envs:Point-v0` in any process."""

import stub_envs

stub_envs.register()
