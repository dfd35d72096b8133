"""Wrappers for the corridor and for Gymnasium's MuJoCo envs alike."""

from socialnav_env.wrappers.episode_metrics import EpisodeMetrics
from socialnav_env.wrappers.fixed_horizon import FixedHorizon
from socialnav_env.wrappers.record_state import RecordState
from socialnav_env.wrappers.social_metrics import SocialMetrics, VectorSocialMetrics
from socialnav_env.wrappers.table import MetricsTable, Row, compare

__all__ = [
    "EpisodeMetrics",
    "FixedHorizon",
    "MetricsTable",
    "RecordState",
    "Row",
    "SocialMetrics",
    "VectorSocialMetrics",
    "compare",
]
