"""
What changes when somebody walks faster?
========================================

Steps become longer and quicker, and knees bend more. Here the average person of ``walk/fpca`` walks at five speeds;
``variation=0`` makes all strides of a walk the same.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.gait import Session, analyse

speeds = (0.9, 1.1, 1.3, 1.5, 1.7)
sessions = []
for speed in speeds:
    walk = motionenv.synthesize("walk/fpca", 8, 100, deviations=[], speed=speed, variation=0)
    sessions.append(Session((analyse(walk),), left_out={}))

measured = [{p.name: p.mean for p in session.parameters if not p.side} for session in sessions]
for speed, found in zip(speeds, measured, strict=True):
    ratio = 1000 * found["walk_ratio"]
    print(f"{speed} m/s: walk ratio {ratio:.1f} mm/(steps/min), stance {found['stance']:.0f} %")

# %%
# Left: cadence and step length grow together, so that the walk ratio, step length over cadence, stays nearly the same.
# The model has this from published walks (Sekiya & Nagasaki 1998). Right: the knee bends more as the leg takes the
# body's weight, at about 10 % of the cycle, and a little more in swing. Stance ends earlier in the cycle.

colours = plt.cm.viridis(np.linspace(0, 0.9, len(speeds)))
figure, (steps, knees) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
line = np.array([(found["cadence"], found["step_length"]) for found in measured])
steps.plot(*line.T, "0.8", zorder=0)
for speed, place, session, colour in zip(speeds, line, sessions, colours, strict=True):
    steps.plot(*place, "o", color=colour, markersize=8)
    knees.plot(session.mean_curve("left", "knee_flexion")[0], color=colour, label=f"{speed} m/s")
steps.set(xlabel="cadence [steps/min]", ylabel="step length [m]")
knees.set(xlabel="gait cycle from initial contact [%]", ylabel="knee flexion [°]")
knees.set(xlim=(0, 100), ylim=(0, None))
knees.legend(fontsize="small", loc="upper left")
