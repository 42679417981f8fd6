"""
C, fig. 5: what does synthesised motion look like?
==================================================

Two seconds at 30 frames per second, each pose in grey, with the paths of wrists and ankles over it. The paper shows
running, from a database of several activities, and concludes from its regularly planted feet that periodicity is
preserved although the phase isn't modelled. Ours walks, because ``mixed/tree`` holds only walking.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.body import EDGES
from motionenv.types import MARKERS

motion = motionenv.load("mixed/tree").generator("brisk walk", seed=3).motion(2)
places = motionenv.markers(motion.poses, motion.skeleton)
steps = np.diff(places[:, MARKERS.index("pelvis"), :2], axis=0)
speed = np.linalg.norm(steps, axis=1).mean() * motion.fps
print(f"mean speed {speed:.2f} m/s")

figure, axis = plt.subplots(figsize=(9, 4.6), layout="constrained")
for a, b in EDGES:
    x, _, z = places[:, (a, b)].T
    axis.plot(x, z, color="0.8", linewidth=0.7)
for joint, style in (("wrist", "--"), ("ankle", "-")):
    for side, colour in (("left", "#0072b2"), ("right", "#d55e00")):
        path = places[:, MARKERS.index(f"{side}_{joint}")]
        axis.plot(path[:, 0], path[:, 2], style, color=colour, label=f"{side} {joint}")
axis.set(aspect="equal", xlabel="forward [m]", ylabel="height [m]", ylim=(0, None))
figure.legend(fontsize="small", ncols=4, loc="outside upper center", frameon=False)

# %%
# The feet are planted as regularly here. They also stay where they stand, which the paper's model doesn't ensure ("no
# notion of gravity, friction, and position of the feet relative to the floor"): our generator adds foot contact, and
# blends where it changes from one clip to another.
