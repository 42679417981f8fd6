"""
A, fig. 5: how long is a cycle?
===============================

Cut a walk into pieces of equal length and lay them on top of each other: they agree if the length is that of the
cycle. The signal-to-noise ratio (eq. 1 to 3) measures how well they agree. Here it is computed for the 19 joint
angles of a synthesised person at 120 frames per second, with white noise as a 20th channel.

As in the paper, the angles share one sharp peak, and noise has none. The paper's peak is at 126 frames (1.05 s), for
one of its captured walks. Two cycles fold as well as one: the knee's second peak is even higher than its first.
`estimate_period` returns the shortest length after which the motion recurs (dashed line).
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.cycles import estimate_period
from motionenv.types import ANGLES

walk = motionenv.synthesize("walk/fpca", seconds=12, fps=120, seed=4)
noise = np.random.default_rng(1).standard_normal((len(walk.angles), 1))
found = estimate_period(np.hstack([walk.angles, noise]), fps=120)

shown = ("left_hip_flexion", "left_knee_flexion", "left_elbow_flexion")
columns = [*(ANGLES.index(name) for name in shown), -1]
curves = [*found.curve.channels[:, columns].T, found.curve.total]
titles = [*(name.replace("_", " ") for name in shown), "white noise", "sum of all 20"]

figure, axes = plt.subplots(1, 5, figsize=(9, 2.4), layout="constrained", sharex=True)
for axis, curve, title in zip(axes, curves, titles, strict=True):
    axis.axvline(found.frames, color="C1", linestyle="--", linewidth=1)
    axis.plot(found.curve.candidates, curve)
    axis.set_title(title, fontsize="small")
    axis.tick_params(labelsize="small")
figure.supxlabel("candidate length [frames]", fontsize="medium")
axes[0].set_ylabel("signal-to-noise ratio")
print(f"cycle: {found.frames:.1f} frames, {found.seconds:.2f} s")
print(f"sum at the peak: {found.peak:.0f}; noise at most {curves[3].max():.1f}")

# %%
# The paper's sum is 899 at its peak. Only the places of peaks can be compared, not their heights, which grow with the
# number of cycles and with how exactly they repeat.
