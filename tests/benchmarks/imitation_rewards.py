"""Trains reward models of imitation in a Python of its own, since it needs an older Gymnasium.

Arguments: an .npz of segments and pairs, hidden units by commas, members, pairs of a minibatch.
Each line on standard input is a number of epochs; the answer is the processor time that they took
[s].
"""

import sys
import tempfile
import time

import gymnasium as gym
import numpy as np
import torch
from imitation.algorithms.preference_comparisons import (
    BasicRewardTrainer,
    CrossEntropyRewardLoss,
    EnsembleTrainer,
    PreferenceDataset,
    PreferenceModel,
)
from imitation.data.types import TrajectoryWithRew
from imitation.rewards.reward_nets import BasicRewardNet, RewardEnsemble
from imitation.util import logger

torch.set_num_threads(1)
data = np.load(sys.argv[1])
hidden = tuple(map(int, sys.argv[2].split(",")))
members, batch_size = map(int, sys.argv[3:5])
observations, actions, rewards = data["observations"], data["actions"], data["rewards"]
fragments = [
    TrajectoryWithRew(
        obs=np.concatenate([seen, seen[-1:]]), acts=done, infos=None, terminal=False, rews=paid
    )
    for seen, done, paid in zip(observations, actions, rewards, strict=True)
]
dataset = PreferenceDataset()
dataset.push(
    [(fragments[first], fragments[second]) for first, second in data["pairs"]],
    data["preferences"].astype(np.float32),
)
spaces = [gym.spaces.Box(-10.0, 10.0, a.shape[2:]) for a in (observations, actions)]
nets = [BasicRewardNet(*spaces, hid_sizes=hidden) for _ in range(members)]
settings = {
    "loss": CrossEntropyRewardLoss(),
    "rng": np.random.default_rng(0),
    "batch_size": batch_size,
    "epochs": 1,
    "custom_logger": logger.configure(tempfile.mkdtemp(), format_strs=[]),
}
if members == 1:
    trainer = BasicRewardTrainer(PreferenceModel(nets[0]), **settings)
else:
    trainer = EnsembleTrainer(PreferenceModel(RewardEnsemble(*spaces, nets)), **settings)
print("ready", flush=True)
for line in sys.stdin:
    start = time.process_time()
    trainer.train(dataset, epoch_multiplier=int(line))
    print(time.process_time() - start, flush=True)
