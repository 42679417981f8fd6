"""
C, fig. 5: two seconds of synthesised motion
============================================

Every pose grey, the ways of hands and feet drawn over it. The paper shows running, and regularly planted feet
although phase isn't modelled. Ours walks, because no recordings may ship; the feet are planted as regularly, and kept
in place.
"""

import matplotlib.pyplot as plt

import motionenv
from motionenv.body import EDGES
from motionenv.types import MARKERS

motion = motionenv.load("mixed/tree").generator("brisk walk", seed=3).motion(2)
places = motionenv.markers(motion.poses, motion.skeleton)
figure, axis = plt.subplots(figsize=(9, 3.6), layout="constrained")
for a, b in EDGES:
    axis.plot(places[:, (a, b), 0].T, places[:, (a, b), 2].T, color="0.8", linewidth=0.8)
for joint, style in (("wrist", "--"), ("ankle", "-")):
    for side, colour in (("left", "C0"), ("right", "C1")):
        way = places[:, MARKERS.index(f"{side}_{joint}")]
        axis.plot(way[:, 0], way[:, 2], style, color=colour, label=f"{side} {joint}")
axis.set(aspect="equal", xlabel="forward [m]", ylabel="up [m]")
axis.legend(fontsize="small", ncols=4, loc="upper center", bbox_to_anchor=(0.5, 1.2))
