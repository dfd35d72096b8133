"""A policy for a reward model that is finished already."""

from __future__ import annotations

from functools import partial

from polite.methods.preference_learning import Follow, Learned, MakeEnv, Report
from polite.methods.setup import independent_seeds
from polite.policies.ppo import PpoConfig, PpoTrainer
from polite.rewards.ensemble import RewardEnsemble
from polite.rewards.network import RewardNet, predict


def train_on_given(
    make_env: MakeEnv,
    model: RewardNet | RewardEnsemble,
    ppo: PpoConfig,
    steps: int,
    seed: int,
    report: Report = lambda says, share: None,
    follow: Follow = lambda episodes: None,
) -> Learned:
    """Train a new policy that the model pays, as it is.

    That a reward leads there from the start, without the policy that it was learned beside, is not
    a matter of course (McKinney et al., On The Fragility of Learned Reward Functions, 2023).

    Args:
        make_env: makes the envs, of the model's sizes.
        model: pays the policy.
        ppo: how the policy is trained.
        steps: PPO steps.
        seed: everything random follows from it.
        report: told how far it is.
        follow: given the finished episodes after each rollout.

    Raises:
        ShapeError: if the model does not fit the env.
        NotFiniteError: if the env gives NaN or infinity.
    """
    env_seed, policy_seed = independent_seeds(seed, 2)
    env = make_env(ppo.num_envs, env_seed)
    done = 0

    def note(policy_steps: int) -> None:
        nonlocal done
        done = policy_steps
        follow(trainer.episodes)
        report("training the policy", min(1.0, done / steps))

    try:
        trainer = PpoTrainer(env, ppo, policy_seed, steps, partial(predict, model))
        report("training the policy", 0.0)
        trainer.train(steps, note)
        return Learned(
            policy=trainer.policy(),
            reward=model,
            feedback=None,
            episodes=trainer.episodes,
            sessions=[],
            policy_steps=done,
            collection_steps=0,
        )
    finally:
        env.close()
