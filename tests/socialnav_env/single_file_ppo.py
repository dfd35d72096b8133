"""PPO in one file with nothing but torch, in the manner of CleanRL.

After Huang et al., CleanRL: high-quality single-file implementations of deep reinforcement learning
algorithms, JMLR 23 (2022), and Schulman et al., Proximal policy optimization algorithms (2017). It
stands for the training code that people bring: it knows Gymnasium's vector interface and no more.
"""

import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from torch import nn
from torch.distributions import Normal

GAMMA, LAMBDA, CLIP, RATE, EPOCHS, MINIBATCHES = 0.97, 0.95, 0.2, 2e-3, 10, 8


class Agent(nn.Module):
    def __init__(self, envs):
        super().__init__()
        self.scale = tensor(envs.single_observation_space.high)
        inputs, outputs = len(self.scale), envs.single_action_space.shape[0]
        self.critic = nn.Sequential(nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 1))
        self.actor = nn.Sequential(nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, outputs))
        self.log_std = nn.Parameter(torch.full((outputs,), -0.5))

    def mode(self, observations):
        return self.actor(observations / self.scale)

    def policy(self, observations):
        return Normal(self.mode(observations), self.log_std.exp())

    def value(self, observations):
        return self.critic(observations / self.scale).squeeze(-1)


def tensor(array):
    return torch.as_tensor(np.asarray(array), dtype=torch.float32)


def advantages_of(rewards, values, ends, last_value):
    """(T, N) generalised advantage estimates; an episode's end cuts them."""
    advantages = torch.zeros_like(rewards)
    following, tail = last_value, torch.zeros_like(last_value)
    for t in reversed(range(len(rewards))):
        going_on = 1.0 - ends[t]
        delta = rewards[t] + GAMMA * following * going_on - values[t]
        tail = delta + GAMMA * LAMBDA * going_on * tail
        advantages[t], following = tail, values[t]
    return advantages


def train(envs, updates, steps, seed):
    """Train on a vector env with AutoresetMode.SAME_STEP for updates * steps * N env steps."""
    assert envs.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    generator = torch.Generator().manual_seed(seed)
    with torch.random.fork_rng():
        torch.manual_seed(seed)
        agent = Agent(envs)
    optimizer = torch.optim.Adam(agent.parameters(), lr=RATE)
    now = tensor(envs.reset(seed=seed)[0])
    for _ in range(updates):
        rows = []
        for _ in range(steps):
            with torch.no_grad():
                policy, value = agent.policy(now), agent.value(now)
                noise = torch.randn(policy.mean.shape, generator=generator)
                actions = policy.mean + policy.stddev * noise
                log_probability = policy.log_prob(actions).sum(-1)
                following, rewards, terminated, truncated, info = envs.step(actions.numpy())
                rewards = tensor(rewards)
                for n in np.flatnonzero(truncated & ~terminated):  # time is up, the task is not
                    rewards[n] += GAMMA * agent.value(tensor(info["final_obs"][n]))
            rows.append((now, actions, log_probability, rewards, value, terminated | truncated))
            now = tensor(following)
        seen, acted, logged, rewards, values, ends = (
            torch.stack([torch.as_tensor(item) for item in column])
            for column in zip(*rows, strict=True)
        )
        with torch.no_grad():
            gained = advantages_of(rewards, values, ends.float(), agent.value(now))
        batch = [item.flatten(0, 1) for item in (seen, acted, logged, gained, gained + values)]
        for _ in range(EPOCHS):
            for chosen in torch.randperm(len(batch[0]), generator=generator).chunk(MINIBATCHES):
                loss = loss_of(agent, *(item[chosen] for item in batch))
                optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
                optimizer.step()
    return lambda observation: agent.mode(tensor(observation)).detach().numpy()


def loss_of(agent, seen, acted, logged, gained, returns):
    """The clipped surrogate, and the squared error of the values."""
    ratio = (agent.policy(seen).log_prob(acted).sum(-1) - logged).exp()
    gained = (gained - gained.mean()) / (gained.std() + 1e-8)
    surrogate = torch.min(ratio * gained, ratio.clamp(1.0 - CLIP, 1.0 + CLIP) * gained)
    return 0.5 * (agent.value(seen) - returns).square().mean() - surrogate.mean()
