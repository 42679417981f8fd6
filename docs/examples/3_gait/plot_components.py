"""
How many components do gait cycles need?
========================================

More components always fit the cycles better that they were fitted to. What counts is people whom the model hasn't seen:
`n_components="likelihood"` leaves people out in folds, and takes the number with which their cycles are most likely.
Thirty people's walks are made here, and measured with errors of 2°; use your own cycles in their place.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.models.fpca import plots

seeds, rng = range(30), np.random.default_rng(0)
people = [motionenv.synthesize("walk/fpca", seconds=5, fps=60, seed=seed).angles for seed in seeds]
measured = [angles + np.radians(2) * rng.standard_normal(angles.shape) for angles in people]
cycles = motionenv.segment(measured, fps=60, subjects=[str(seed) for seed in seeds])
fpca = motionenv.FunctionalPCA("likelihood").fit(cycles)
shares = fpca.explained_variance_ratio_
print(f"{fpca.n_components_} components explain {shares.sum():.0%}; residuals are {fpca.noise_ratio_:.0%}")
curve = fpca.selection_
figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3), layout="constrained")
left.bar(np.arange(len(shares)) + 1, 100 * shares, label="each")
left.plot(np.arange(len(shares)) + 1, 100 * shares.cumsum(), ".-", label="together")
left.set(xlabel="component", ylabel="share of variance [%]", ylim=(0, 100))
left.legend()
right.errorbar(curve.n_components, curve.score, curve.error, fmt=".-")
right.set(xlabel="components", ylabel="log-likelihood per sample", title="cycles of people left out")

# %%
# Two standard deviations along each component to either side of the mean, in the angles that differ most between
# people: the usual way to see what a component is.

figure = plots.components(fpca)

# %%
# Each cycle in the space of the first two components, one colour a person, with the standard deviation of what it
# doesn't tell.

scores, covariance = fpca.transform(cycles, return_cov=True)
unsure = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
figure, axis = plt.subplots(layout="constrained")
for person in np.unique(cycles.subject):
    own = np.asarray(cycles.subject) == person
    (x, y), (dx, dy) = scores[own, :2].T, unsure[own, :2].T
    axis.errorbar(x, y, dy, dx, fmt=".", elinewidth=0.5)
axis.set(xlabel="score 1", ylabel="score 2")

# %%
# What the components leave: about one noise standard deviation everywhere, if they are enough.

values = cycles.values[..., [cycles.channels.index(name) for name in fpca.channels_]]
left_over = values - fpca.inverse_transform(fpca.transform(values))
ratio = np.sqrt(np.nanmean(left_over**2, axis=0) / fpca.noise_variance_)
figure, axis = plt.subplots(figsize=(7, 4.5), layout="constrained")
drawn = axis.imshow(ratio.T, aspect="auto", cmap="Greys", vmin=0, vmax=3, extent=(0, 100, len(ratio.T), 0))
axis.set_yticks(np.arange(len(fpca.channels_)) + 0.5, [name.replace("_", " ") for name in fpca.channels_])
axis.set(xlabel="cycle [%]")
figure.colorbar(drawn, label="residual / its SD")
