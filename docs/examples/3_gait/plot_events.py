"""
When does a foot touch the ground?
==================================

`motionenv.gait.find_events` takes initial contacts and toe-offs from the file or its force plates where it has them,
and otherwise finds them in the paths of the heels and toes. Here it has the paths only.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.gait import feet_of, find_events

# In place of motionenv.read("walk.c3d"):
walk = motionenv.synthesize("walk/fpca", seconds=4, fps=100, seed=3)
feet = feet_of(walk)
events = find_events(feet)
for side in ("left", "right"):
    for kind in ("initial_contact", "toe_off"):
        print(f"{side:5} {kind:15} {np.round(events.times(kind, side), 2)} s")

# %%
# Solid lines are initial contacts, when the heel lands; dotted ones are toe-offs. From a solid line to the next dotted
# one the foot stands.
#
# With captured markers at 100 frames/s or more, the median error against force plates is 7 ms for contacts and 5 ms for
# toe-offs. In the motion of a fitted body the contacts are less exact, 23 ms (``mocap.events`` in the
# :doc:`results </made/results>`).

figure, axes = plt.subplots(
    2, 1, figsize=(9, 4.2), layout="constrained", sharex=True, sharey=True
)  # fmt: skip
time = np.arange(len(feet.pelvis)) / feet.fps
for axis, side in zip(axes, ("left", "right"), strict=True):
    axis.plot(time, 100 * feet.heel[side][:, 2], color="#0072b2", label="heel")
    axis.plot(time, 100 * feet.toe[side][:, 2], color="#d55e00", label="toe")
    for kind, style in (("initial_contact", "-"), ("toe_off", ":")):
        for event in events.times(kind, side):
            axis.axvline(event, color="black", linestyle=style, linewidth=1)
    axis.set(ylabel="height [cm]", xlim=(0, 4))
    axis.set_title(side, fontsize="medium")
axes[1].set_xlabel("time [s]")
axes[0].legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2, fontsize="small", frameon=False)
