"""
C, fig. 4: what does the tree draw, beside a Gaussian?
======================================================

Four coefficients of 1,000 windows drawn at β = 1 for one history. The paper sees general agreement of the tree's
draws with the Gaussian about the history, and calls them an approximation. Orange is the tree; blue draws exactly
from what eq. 3 defines.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv

tree = motionenv.load("mixed/tree")
history = motionenv.synthesize("walk/fpca", seconds=2, fps=30, seed=10, speed=1.3)
probe = tree.coefficients(history)
figure, axes = plt.subplots(1, 4, figsize=(10, 2.8), layout="constrained", sharey=True)
x = np.linspace(-4, 4, 200)
for method, colour in (("exact", "C0"), ("tree", "C1")):
    windows = tree.sample(history, 1000, temperature=1.0, seed=0, method=method).windows
    drawn = tree.index_.coefficients(windows)
    for axis, k in zip(axes, (3, 7, 11, 15), strict=True):
        axis.hist(drawn[:, k - 1], bins=40, range=(-4, 4), density=True, histtype="step", color=colour, label=method)
for axis, k in zip(axes, (3, 7, 11, 15), strict=True):
    axis.plot(x, np.exp(-0.5 * (x - probe[k - 1]) ** 2) / np.sqrt(2 * np.pi), "--", color="0.5", label="Gaussian")
    axis.set(xlabel=f"coefficient {k}, over its σ")
axes[0].legend(fontsize="small")
axes[0].set_ylabel("density")
