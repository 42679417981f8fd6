"""
How many components do gait cycles need?
========================================

More components always fit the cycles better that they were fitted to. What counts is people whom the model hasn't seen:
`n_components="likelihood"` leaves people out in folds, and takes the number with which their cycles are most likely.
Twenty people's walks are made here, and measured with errors of 2°; use your own cycles in their place.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv

seeds, rng = range(20), np.random.default_rng(0)
people = [motionenv.synthesize("walk/fpca", seconds=5, fps=60, seed=seed).angles for seed in seeds]
measured = [angles + np.radians(2) * rng.standard_normal(angles.shape) for angles in people]
cycles = motionenv.segment(measured, fps=60, subjects=[str(seed) for seed in seeds])
fpca = motionenv.FunctionalPCA("likelihood").fit(cycles)
curve, shares = fpca.selection_, fpca.explained_variance_ratio_
print(f"{fpca.n_components_} components explain {shares.sum():.0%}; noise is {fpca.noise_ratio_:.0%}")

figure, (scree, left_out, knee, scores) = plt.subplots(1, 4, figsize=(11, 3), layout="constrained")
scree.bar(range(1, len(shares) + 1), 100 * shares, color="0.6")
scree.set(xlabel="component", ylabel="share of variance [%]", title="scree")
left_out.errorbar(curve.n_components, curve.score, curve.error, color="C0", marker="o")
left_out.axvline(curve.best, color="0.6", linestyle="--")
left_out.set(xlabel="components", ylabel="log-likelihood per sample", title="people left out")

# %%
# The mean of an angle with a band that holds the mean of all such people with 90 % confidence, at all phases at once;
# and two standard deviations along the first component to either side, the usual way to draw one.

channel, percent = fpca.channels_.index("left_knee_flexion"), np.arange(128) / 1.28
mean, band = (np.degrees(curve_[:, channel]) for curve_ in (fpca.mean_, fpca.mean_band(0.9, simultaneous=True)))
step = np.degrees(2 * np.sqrt(fpca.explained_variance_[0]) * fpca.components_[0][:, channel])
knee.fill_between(percent, mean - band, mean + band, color="0.8")
knee.plot(percent, mean, color="black")
knee.plot(percent, mean + step, color="C0", label="+ 2 SD")
knee.plot(percent, mean - step, color="C1", linestyle="--", label="- 2 SD")
knee.set(xlabel="cycle [%]", ylabel="left knee flexion [°]", title="component 1")
knee.legend(fontsize="small")

# %%
# Each person's cycles in the space of the first two components, with the standard deviation of what they don't tell.

where, covariance = fpca.transform(cycles, return_cov=True)
unsure = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
for person in sorted(set(cycles.subject))[:8]:
    own = np.array(cycles.subject) == person
    scores.errorbar(*where[own, :2].T, *unsure[own, 1::-1].T, fmt=".", elinewidth=0.5)
scores.set(xlabel="score 1 [rad]", ylabel="score 2 [rad]", title="cycles of 8 people")
