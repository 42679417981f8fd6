"""
A, figs. 6 and 7: when does each person's cycle begin?
======================================================

Walks that are to be compared must be at the same phase of the cycle at the same time. The algorithm of fig. 6 fits a
smooth periodic reference to all walks, shifts each walk to where it agrees with the reference best, and repeats both
until nothing improves.

Top: eight walks as they were cut, each at another moment of the cycle. Bottom: aligned, with the reference in red, as
in fig. 7. The paper's walks are of four captured people, two from each; ours are of eight synthesised people.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.cycles import align, estimate_period, periodic_basis
from motionenv.types import ANGLES

walks = []
for seed in range(8):
    walk = motionenv.synthesize("walk/fpca", 6, fps=120, seed=seed, phase=seed / 8)
    walks.append(walk.angles)
periods = [estimate_period(walk, fps=120).frames for walk in walks]
found = align(walks, periods)

grid = np.linspace(0, 1, 200)
reference = np.degrees(periodic_basis(grid) @ found.reference)
figure, axes = plt.subplots(2, 3, figsize=(9, 4.6), sharex=True, sharey="col")
figure.set_layout_engine("constrained")
shown = ("left_hip_flexion", "left_knee_flexion", "left_elbow_flexion")
for column, name in zip(axes.T, shown, strict=True):
    channel = ANGLES.index(name)
    for i, walk in enumerate(walks):
        frames = np.arange(len(walk))
        cut = np.mod(frames / found.periods[i], 1)
        angle = np.degrees(walk[:, channel])
        column[0].plot(cut, angle, ".", markersize=1, color="C0")
        column[1].plot(found.phase(i, frames), angle, ".", markersize=1, color="C0")
    column[1].plot(grid, reference[:, channel], color="C3", linewidth=2)
    column[0].set_title(name.replace("_", " "))
    column[1].set_xlabel("phase [cycles]")
axes[0, 0].set_ylabel("as cut [°]")
axes[1, 0].set_ylabel("aligned [°]")

rms = np.degrees(np.sqrt(found.errors / sum(walk.size for walk in walks)))
print(f"rms deviation from the reference: {rms[0]:.1f}° as cut, {rms[-1]:.1f}° aligned")
print(f"rounds: {len(rms) - 1}")

# %%
# The deviation is over all 19 joint angles. The paper's run converged after five steps. What remains after alignment
# is how people differ, which the components of :doc:`figs. 9 and 10 <plot_a09_components>` describe. Here one person
# bends the left elbow least when everybody else bends it most.
