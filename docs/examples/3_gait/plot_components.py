"""
How many components do gait cycles need?
========================================

More components always fit the cycles better that they were fitted to. What counts is people whom the model hasn't seen:
`n_components="likelihood"` leaves people out in folds, and takes the number with which their cycles are most likely.
Thirty people's walks are made here, and measured with errors of 2°; use your own cycles in their place.
"""

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
figure = plots.scree(fpca)

# %%
# Two standard deviations along each component to either side of the mean, in the angles that differ most between
# people: the usual way to see what a component is.

figure = plots.components(fpca)

# %%
# Each cycle in the space of the first two components, one colour a person, with the standard deviation of what it
# doesn't tell.

figure = plots.scores(fpca, cycles)

# %%
# What the components leave: about one noise standard deviation everywhere, if they are enough.

figure = plots.residuals(fpca, cycles)
