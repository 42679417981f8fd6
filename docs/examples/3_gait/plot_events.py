"""
When does a foot touch the ground?
==================================

Events are found from the feet's paths, or from force plates where a file has them.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.body import markers
from motionenv.gait import feet_of, find_events
from motionenv.types import MARKERS

walk = motionenv.synthesize("walk/fpca", seconds=4, fps=100, seed=3)
events = find_events(feet_of(walk))
heights = markers(walk.poses, walk.skeleton)[..., 2]
figure, axis = plt.subplots(figsize=(9, 3), layout="constrained")
for side, colour in (("left", "#0072b2"), ("right", "#d55e00")):
    height = heights[:, MARKERS.index(f"{side}_ankle")]
    axis.plot(np.arange(len(height)) / walk.fps, height, color=colour, label=f"{side} ankle")
    for event in (e for e in events.events if e.side == side):
        style = "-" if event.kind == "initial_contact" else ":"
        axis.axvline(event.time, color=colour, linestyle=style, linewidth=1)
axis.set(xlabel="time [s]", ylabel="height [m]", title="initial contact: solid; toe off: dotted")
axis.legend(loc="upper right")
