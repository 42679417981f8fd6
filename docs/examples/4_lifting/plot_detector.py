"""
How wrong are a detector's keypoints?
=====================================

`DetectorErrors` errs as detectors do: each point is off in its own way for a while, and some are missing. The film
that a detector would see is as exact as before.
"""

import matplotlib.pyplot as plt

import motionenv
from motionenv.mocap.keypoints import DetectorErrors
from motionenv.render import render
from motionenv.types import MARKERS, Points

walk = motionenv.synthesize("walk/fpca", seconds=3, fps=30, seed=7)
places = motionenv.markers(walk.poses, walk.skeleton)
camera = motionenv.fit_view(places, alpha=0.3, width=480, height=240)
exact = Points(camera.project(places)[0], 30, "px")
seen = DetectorErrors().apply(exact, rng=1)

figure, (still, over_time) = plt.subplots(1, 2, figsize=(10, 3), layout="constrained")
still.imshow(render(walk.poses[45:46], walk.skeleton, camera).rgb[0])
still.plot(*exact.positions[45].T, "o", color="white", markeredgecolor="black", markersize=3)
still.plot(*seen.positions[45].T, "x", color="#d55e00", markersize=4)
still.axis("off")
wrist = MARKERS.index("left_wrist")
over_time.plot(seen.positions[:, wrist] - exact.positions[:, wrist], label=("across", "down"))
over_time.set(xlabel="frame", ylabel="error of the left wrist [pixels]")
over_time.legend()
