"""
How does a walk compare with the norm?
======================================

Joint angles over the gait cycle, from initial contact to the next of the same foot, against the band of the eleven
people from whom the shipped models were learned.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.gait import Session, analyse, shipped_band

# In place of motionenv.read("walk.c3d"):
walk = motionenv.synthesize("walk/fpca", seconds=8, fps=100, seed=3)
session = Session((analyse(walk),), left_out={})
band = shipped_band()
for p in session.parameters[:3]:
    print(f"{p.name}: {p.mean:.4g} {p.unit}, 95 % interval {p.low:.4g} to {p.high:.4g}")

# %%
# Printed are means over strides with their 95 % intervals. The curves are also means over strides; the band is the mean
# ± 1 standard deviation over people. This walker's left knee stays bent in stance, and the hips are adducted unequally.
#
# Compare shapes before offsets: in the band's captures, the trunk stands for the pelvis. `motionenv.gait.read_group`
# makes a band of your own people from a folder of captures.

figure, axes = plt.subplots(1, 3, figsize=(9, 3.2), layout="constrained")
for axis, name in zip(axes, ("hip_flexion", "knee_flexion", "hip_adduction"), strict=True):
    mean, deviation = band.of(name)
    percent = np.arange(len(mean))
    low, high = mean - deviation, mean + deviation
    axis.fill_between(percent, low, high, color="0.87", label=f"{band.people} people")
    for side, colour in (("left", "#0072b2"), ("right", "#d55e00")):
        axis.plot(percent, session.mean_curve(side, name)[0], color=colour, label=side)
    axis.set(title=name.replace("_", " "), xlabel="gait cycle [%]", xlim=(0, 100))
axes[0].set_ylabel("angle [°]")
axes[1].legend(fontsize="small", loc="upper left")
