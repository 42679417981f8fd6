"""
What changes when somebody walks faster?
========================================

Steps become longer and quicker, so that their ratio stays about the same, and knees bend more.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.gait import Session, analyse

speeds = np.arange(0.9, 1.8, 0.2)
found = {"cadence": [], "step_length": []}
figure, (steps, knees) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
for i, speed in enumerate(speeds):
    walk = motionenv.synthesize("walk/fpca", seconds=8, fps=100, deviations=[], speed=speed, variation=0)
    session = Session((analyse(walk),), left_out={})
    told = {p.name: p.mean for p in session.parameters if not p.side}
    for name, values in found.items():
        values.append(told[name])
    knee, _ = session.mean_curve("left", "knee_flexion")
    knees.plot(knee, color=plt.cm.viridis(i / 4), label=f"{speed:.1f} m/s")
steps.plot(found["cadence"], found["step_length"], "o-")
for speed, x, y in zip(speeds, *found.values(), strict=True):
    steps.annotate(f" {speed:.1f} m/s", (x, y), va="top")
steps.set(xlabel="cadence [steps/min]", ylabel="step length [m]")
knees.set(xlabel="gait cycle from initial contact [%]", ylabel="knee flexion [°]")
knees.legend()
