"""
How does a walk compare with the norm?
======================================

Joint angles over the gait cycle, left and right, before the band of the eleven people of the shipped models.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.gait import Session, analyse, shipped_band

walk = motionenv.synthesize("walk/fpca", seconds=8, fps=100, seed=3)  # in place of motionenv.read("walk.c3d")
session = Session((analyse(walk),), left_out={})
band = shipped_band()
shown = ("hip_flexion", "knee_flexion", "hip_adduction")
figure, axes = plt.subplots(1, 3, figsize=(9, 3), layout="constrained")
for axis, name in zip(axes, shown, strict=True):
    mean, deviation = band.mean[name], band.sd[name]
    percent = np.linspace(0, 100, len(mean))
    axis.fill_between(percent, mean - deviation, mean + deviation, color="0.85", label="mean ± 1 SD of 11 people")
    for side, colour in (("left", "#0072b2"), ("right", "#d55e00")):
        curve, _ = session.mean_curve(side, name)
        axis.plot(np.linspace(0, 100, len(curve)), curve, color=colour, label=side)
    axis.set(title=name.replace("_", " "), xlabel="gait cycle [%]")
axes[0].set_ylabel("angle [°]")
axes[0].legend(fontsize="small")
