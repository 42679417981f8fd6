"""
C, fig. 7: and a whole body?
============================

With 300 particles the example-based model keeps the body for 30 frames, and constant velocity is far from it: 25
dimensions can't be covered. The paper shows one film; here the error per joint over time, for five drawn people whom
the tree doesn't hold, silhouettes from the side, the first pose given.
"""

import gymnasium
import matplotlib.pyplot as plt
import numpy as np

import motionenv
import motionenv.envs
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.tracking import ParticleFilter, Start, TreePrior, VelocityPrior


def errors(prior, seed: int) -> list[float]:
    """Mean error per joint [mm] in each of 30 frames."""
    env = gymnasium.make(
        "motionenv/WalkerTracking-v1", observation="mask", size=128, start="line", split="eval", actions="metric",
        horizon=31,
    )  # fmt: skip
    seen, _ = env.reset(seed=seed)
    truth = env.unwrapped.truth()
    body = truth["skeleton"]
    tracker = ParticleFilter(prior(body), SilhouetteLikelihood(truth["camera"], body), n=300, seed=1)
    tracker.start(Start.at(truth["pose"]))
    found = []
    for _ in range(30):
        mean = tracker.step(mask=seen[..., 0]).mean
        off = motionenv.markers(mean, body) - motionenv.markers(env.unwrapped.truth()["pose"], body)
        found.append(1000 * np.linalg.norm(off, axis=-1).mean())
        seen, *_ = env.step(mean.astype(np.float32))
    return found


priors = {
    "example-based": lambda body: TreePrior("mixed/tree", skeleton=body),
    "constant velocity": lambda body: VelocityPrior(skeleton=body),
}
figure, axis = plt.subplots(figsize=(5.5, 3.6), layout="constrained")
for (name, prior), colour in zip(priors.items(), ("C0", "C1"), strict=True):
    for seed in range(5):
        axis.plot(errors(prior, seed), color=colour, label=None if seed else name)
axis.set(xlabel="frame", ylabel="error per joint [mm]", ylim=(0, None))
axis.legend()
