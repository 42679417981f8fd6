"""
A, fig. 5: how long is a cycle?
===============================

The signal-to-noise ratio of the sequence folded at each candidate length (eq. 1 to 3). The paper's peaks at 126
frames of 1/120 s (1.05 s), sharply, for every angle but noise. Ours: a drawn person at 120 frames a second, with
white noise as the last channel. Multiples of the cycle fold as well as the cycle does, so the smallest is taken.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.cycles import estimate_period
from motionenv.types import ANGLES

walk = motionenv.synthesize("walk/fpca", seconds=12, fps=120, seed=4)
shown = ("left_hip_flexion", "left_knee_flexion", "left_elbow_flexion")
angles = walk.angles[:, [ANGLES.index(name) for name in shown]]
noise = np.random.default_rng(1).standard_normal((len(angles), 1))
found = estimate_period(np.hstack([angles, noise]), fps=120)
figure, axes = plt.subplots(1, 5, figsize=(11, 2.6), layout="constrained", sharex=True)
curves = [*found.curve.channels.T, found.curve.total]
for axis, curve, name in zip(axes, curves, (*shown, "white noise", "all"), strict=True):
    axis.plot(found.curve.candidates, curve)
    axis.axvline(found.frames, color="0.6", linewidth=0.8)
    axis.set(title=name.replace("_", " "), xlabel="candidate [frames]")
    axis.title.set_fontsize("small")
axes[0].set_ylabel("signal-to-noise ratio")
print(f"{found.frames:.1f} frames, {found.seconds:.2f} s")
