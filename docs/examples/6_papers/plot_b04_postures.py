"""
B, fig. 4: what does a lifted walker look like from the unseen side?
====================================================================

Five postures of a cycle, true (dashed) and lifted by MAP (solid), for views of 0°, 30° and 90°, seen across the
dimension that is missing. The paper finds no obvious difference; here the walker is drawn from `walk/fpca`, and
unknown to the model, which is that of CMU's 11 people.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.body import EDGES
from motionenv.lifting import maximum_a_posteriori
from motionenv.models.eigenwalkers import fourier_walker
from motionenv.models.eigenwalkers.fourier_series import positions_at

walker = fourier_walker(motionenv.synthesize("walk/fpca", seconds=6, fps=30, seed=12)).coefficients
phases = np.arange(5) * 2 * np.pi / 5
figure, axes = plt.subplots(3, 5, figsize=(9, 8), layout="constrained", sharex=True, sharey=True)
for row, degrees in zip(axes, (0, 30, 90), strict=True):
    alpha = np.radians(degrees)
    across, away = np.array((np.cos(alpha), np.sin(alpha))), np.array((-np.sin(alpha), np.cos(alpha)))
    seen = np.stack([walker[..., :2] @ across, walker[..., 2]], axis=-1)
    lifted = walker.copy()
    lifted[..., 0] = maximum_a_posteriori(motionenv.load("walk/eigenwalkers"), seen, alpha).depth
    truth = walker.copy()
    truth[..., 0] = walker[..., :2] @ away
    for coefficients, style in ((truth, "k--"), (lifted, "C0-")):
        for axis, places in zip(row, positions_at(coefficients, phases), strict=True):
            for a, b in EDGES:
                axis.plot(*places[[a, b]][:, (0, 2)].T, style, linewidth=1.2)
            axis.set(aspect="equal", xlim=(-0.6, 0.6))
    row[0].set_ylabel(f"seen from {degrees}°: up [m]")
for axis in axes[-1]:
    axis.set_xlabel("depth [m]")
