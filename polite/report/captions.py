"""Title and caption of every figure: what it shows and how it was computed."""

from __future__ import annotations

from typing import Final

from polite.analysis.claims_reward import PERSON_NEAR
from polite.analysis.divergence import SMOOTHING

CAPTIONS: Final[dict[str, tuple[str, str]]] = {
    "fig5a_reward_map": (
        "Fig. 5a. Reward along the corridor",
        "Mean learned reward by the robot's position z, both models scored on the same held-out "
        "states, which cover all z evenly. Bold: mean over states and seeds; thin: single seeds; "
        "shaded: ± one standard deviation over the states of a bin, averaged over seeds. Below, "
        "each model's rewards are first standardised over the states, because a reward learned "
        "from comparisons has no scale of its own. People walk: the hatching marks where they "
        "start.",
    ),
    "fig5a_around_objects": (
        "Fig. 5a, continued. Reward around goals and people",
        "The same rewards by signed distance along z to each goal and to the nearest person "
        "(negative: the object is ahead of a robot on its way). Near the end goal people and goal "
        "overlap in z, so a dip at people may not show in the map above. Bands of the background: "
        f"the goal's radius, and {PERSON_NEAR:g} m around a person. Shaded: ± one standard "
        "deviation over states, averaged over seeds.",
    ),
    "map_2d": (
        "Reward on the floor plan",
        "Learned reward, averaged over seeds, of a robot that drives ahead along the corridor at "
        "full speed, put into every cell in turn. The people stand still where they are drawn; "
        "the intermittent goal counts as collected beyond it, the end goal as not yet reached. "
        "One colour scale for both models: (a, b) raw, (c, d) each map minus its mean over its "
        "standard deviation.",
    ),
    "fig5b_goal_distance": (
        "Fig. 5b. Reward against the distance to a goal",
        "Learned reward mapped by (r̂+1)/2, the same for both models, against (a) the distance to "
        "the end goal and (b) to the nearer of the two goals. Green: the goal's radius. Shaded: "
        "± one standard deviation over states, averaged over seeds.",
    ),
    "fig5c_divergence": (
        "Fig. 5c. Divergence of the two reward models",
        "(a) KL(POLITE ‖ baseline) of the two models' reward distributions over the shared "
        "states after each epoch, closed form for normal distributions. A rising curve alone "
        "proves little, since any two models drift apart: the null curves put in POLITE's place a "
        "baseline of another batch order, and POLITE trained on highlights that were "
        "shuffled among the queries. (b) The same divergence from histograms (40 bins on "
        f"[−1, 1], {SMOOTHING:g} added to each count), the other way round, and with each "
        "model's mean taken out: clips of one length leave the level of a learned reward free.",
    ),
    "fig5d_policy": (
        "Fig. 5d. Policies trained on each reward",
        "PPO on each frozen reward model, judged by the true reward, which it never saw; green: "
        "PPO on the true reward itself. (a–c) During training, mean and pointwise 95% t interval "
        "over seeds. (d–f) The final policies: a dot is a seed, the open mark their mean, the "
        "line its 95% t interval.",
    ),
    "reward_quality": (
        "Agreement with the true reward, and distance of the policies",
        "On held-out segments: (a) the share of pairs whose learned returns are ordered as the "
        "true ones, (b) the correlation of learned and true reward over single steps. (c) How far "
        "apart the mean actions of two policies lie on shared states; two baselines of different "
        "seeds give the scale. A dot is a seed, the open mark the mean, the line its 95% t "
        "interval.",
    ),
    "sensitivity": (
        "Sensitivity to the simulated participants",
        "POLITE minus baseline on held-out segments when one property of the participants, or the "
        "number of queries, changes: mean and 95% paired t interval over seeds.",
    ),
    "query_strip": (
        "One query as frames",
        "Evenly spaced frames of the two clips of the example query, time from top to bottom; "
        "frames inside a highlight are framed and named.",
    ),
}
