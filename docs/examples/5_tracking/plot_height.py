"""
How tall is somebody in a clip?
===============================

A body that is told the wrong height stands at the wrong distance. A filter estimates how probable a clip is with the
body that it was given, and this evidence is unbiased. So a chain of filters that keeps a new height as often as its
evidence is greater, times that of the prior, samples the exact posterior: particle marginal Metropolis-Hastings
(Andrieu, Doucet & Holenstein 2010).
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.body import from_height
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.likelihoods.silhouette import EFFECTIVE
from motionenv.render import render
from motionenv.render.cameras import view
from motionenv.tracking import FPCAPrior, ParticleFilter, Start
from motionenv.tracking.priors.base import SPREAD

TRUE, MEDIAN, SPREAD_OF_ADULTS = 1.9, 1.72, 0.07  # [m], [m], and relative
walk = motionenv.synthesize("walk/fpca", seconds=0.4, fps=30, seed=3, height=TRUE)
camera = view(0.3, distance=5.0, width=96, height=96)
masks = render(walk.poses, walk.skeleton, camera, rgb=False).limbs > 0

# %%
# The first pose is known, but for the height of the pelvis. All heights count the same share of the picture's pixels,
# because evidences of different shares can't be compared.

pose, spread = walk.poses[0].copy(), SPREAD.copy()
pose[2] *= MEDIAN / TRUE
spread[2] = 0.1  # [m]
start, temper = Start.at(pose, spread=spread), SilhouetteLikelihood(camera).temper


def score(off: float, rng: np.random.Generator) -> float:
    """Log posterior, up to a constant, of a height that is `off` its median by so many standard deviations."""
    body = from_height(MEDIAN * np.exp(SPREAD_OF_ADULTS * off))
    likelihood = SilhouetteLikelihood(camera, body, threads=1)
    likelihood.effective = EFFECTIVE * temper / likelihood.temper
    tracker = ParticleFilter(FPCAPrior(skeleton=body), likelihood, 500, seed=rng)
    tracker.start(start)
    return sum(tracker.step(mask=mask).log_evidence for mask in masks) - off**2 / 2


rng = np.random.default_rng(1)
here, chain = 0.0, []
now = score(here, rng)
for _ in range(80):
    there = here + rng.standard_normal()
    then = score(there, rng)
    if np.log(rng.random()) < then - now:
        here, now = there, then
    chain.append(MEDIAN * np.exp(SPREAD_OF_ADULTS * here))
heights = np.array(chain[20:])
print(f"{heights.mean():.2f} m ± {heights.std():.2f} m; the walker is {TRUE} m tall")

# %%
# The prior is that of adults whom nobody knows. The silhouettes move it towards the truth, and make it narrower.

grid = np.linspace(1.4, 2.2, 200)
prior = np.exp(-0.5 * (np.log(grid / MEDIAN) / SPREAD_OF_ADULTS) ** 2) / grid
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 2.8), layout="constrained")
left.plot(chain, color="#0072b2")
left.axhline(TRUE, color="black", linestyle="--")
left.set(xlabel="step of the chain", ylabel="height [m]")
right.plot(grid, prior / (prior.sum() * (grid[1] - grid[0])), color="0.6", label="prior")
right.hist(heights, bins=12, density=True, color="#0072b2", alpha=0.6, label="posterior")
right.axvline(TRUE, color="black", linestyle="--", label="truth")
right.set(xlabel="height [m]", yticks=[])
right.legend(frameon=False)
