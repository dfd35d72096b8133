"""Train a reward model on what people said in a web study, whatever the env.

    polite study export DIR --out export
    python examples/people_to_reward.py export --out reward.pt
    polite train --method given --reward reward.pt --out runs/policy

The last line, with the study's --env and --env-settings, trains a policy on it.

The last participant's answers are kept from the training, and tell how well the model foresees what
somebody else prefers.
"""

import argparse
import json
from pathlib import Path

import numpy as np
import torch

from polite import PoliteError, load_feedback
from polite.dataset import Feedback
from polite.rewards.data import stack_feedback
from polite.rewards.files import save_reward_model
from polite.rewards.network import FAST, RewardNet, predict
from polite.rewards.trainer import RewardTrainingConfig, train_reward


def main(export: Path, condition: str, epochs: int, out: Path) -> None:
    feedback = load_feedback(export / "data" / condition)
    pool, queries, answers = feedback.pool, feedback.queries, feedback.answers
    last = max((answer.participant for answer in answers), default=0)
    if last == 0:
        raise ValueError(f"{export}: expected answers of at least two people in {condition}")
    length = json.loads((export / "export.json").read_text(encoding="utf-8"))["highlight_length"]
    generator = torch.Generator().manual_seed(0)
    net = RewardNet(pool.observations.shape[-1], pool.actions.shape[-1], FAST, generator)
    net.standardise(pool)
    learned_from = [answer for answer in answers if answer.participant != last]
    config = RewardTrainingConfig(
        epochs=epochs,
        highlight_length=length,
        highlights="choice",  # as `polite train`; α is 1 in all forms but the paper's
        alpha_positive=1.0,
        alpha_negative=1.0,
    )
    train_reward(net, stack_feedback(Feedback(pool, queries, learned_from)), config, generator)
    save_reward_model(out, net)
    rewards = predict(net, pool.observations, pool.actions)
    returns = np.where(pool.mask, rewards, 0.0).sum(axis=1)
    foreseen = [
        (returns[queries[a.query].second] > returns[queries[a.query].first]) == a.preferred
        for a in answers
        if a.participant == last and a.preferred is not None
    ]
    print(f"learned from {len(learned_from)} answers; foresees {sum(foreseen)} of {len(foreseen)} "
          "preferences of another participant")  # fmt: skip


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("export", type=Path, help="folder of `polite study export`")
    parser.add_argument("--condition", choices=("polite", "baseline"), default="polite")
    parser.add_argument("--epochs", type=int, default=200, help="of training")
    parser.add_argument("--out", type=Path, default=Path("reward.pt"), help="the model's file")
    given = parser.parse_args()
    try:
        main(given.export, given.condition, given.epochs, given.out)
    except (OSError, ValueError, PoliteError) as error:
        parser.error(str(error))
