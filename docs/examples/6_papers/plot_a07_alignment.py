"""
A, figs. 6 and 7: when does each person's cycle begin?
======================================================

Offsets that align eight sequences (blue) with their reference (red), found by the algorithm of fig. 6. The paper has
four people, two sequences each; ours are eight drawn people, each cut at another moment of the cycle.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.cycles import align, estimate_period, periodic_basis
from motionenv.types import ANGLES

walks = [motionenv.synthesize("walk/fpca", seconds=6, fps=120, seed=seed, phase=seed / 8) for seed in range(8)]
angles = [walk.angles for walk in walks]
found = align(angles, [estimate_period(a, 120).frames for a in angles])

grid = np.linspace(0, 1, 200)
reference = periodic_basis(grid) @ found.reference
figure, axes = plt.subplots(2, 3, figsize=(9, 4.4), layout="constrained", sharex=True)
for column, name in zip(axes.T, ("left_hip_flexion", "left_knee_flexion", "left_elbow_flexion"), strict=True):
    channel = ANGLES.index(name)
    for i, a in enumerate(angles):
        before = np.mod(np.arange(len(a)), found.periods[i]) / found.periods[i]
        for axis, phase in zip(column, (before, found.phase(i, np.arange(len(a)))), strict=True):
            axis.plot(phase, np.degrees(a[:, channel]), ",", color="C0")
    column[1].plot(grid, np.degrees(reference[:, channel]), color="C3")
    column[0].set_title(name.replace("_", " "))
    column[1].set_xlabel("phase")
axes[0, 0].set_ylabel("as cut [°]")
axes[1, 0].set_ylabel("aligned [°]")
