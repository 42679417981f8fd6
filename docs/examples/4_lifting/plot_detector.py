"""
How wrong are a detector's keypoints?
=====================================

`DetectorErrors` gives exact points the errors of a 2D keypoint detector: offsets that change slowly, points in the
wrong place, left and right exchanged, and gaps. Use it to test lifting, or to train a network on realistic input.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.mocap.keypoints import DetectorErrors
from motionenv.render import render
from motionenv.types import MARKERS, Points

walk = motionenv.synthesize("walk/fpca", seconds=3, fps=30, seed=7)
places = motionenv.markers(walk.poses, walk.skeleton)
camera = motionenv.fit_view(places, alpha=0.3, width=640, height=360)
exact = Points(camera.project(places)[0], 30, "px")
seen = DetectorErrors().apply(exact, rng=1)

error = np.linalg.norm(seen.positions - exact.positions, axis=-1)
print(f"missing: {np.isnan(error).mean():.0%} of the points")
median, high = np.nanpercentile(error, (50, 95))
print(f"error: median {median:.1f}, 95th percentile {high:.1f} pixels")
tall = np.ptp(exact.positions[..., 1], axis=1).mean()
print(f"for comparison, head to ankle: {tall:.0f} pixels")

# %%
# Left: one frame, with the true markers in white and the detected ones in orange. Right: the error of two markers over
# time. It drifts, so smoothing over a few frames doesn't remove it. The right knee is put in the wrong place for 0.4 s,
# and the left wrist is missing at first.

figure = plt.figure(figsize=(9, 3.6), layout="constrained")
still, over_time = figure.subplots(1, 2, width_ratios=(1, 2))
frame = 45
still.imshow(render(walk.poses[[frame]], walk.skeleton, camera).rgb[0])
for true, found in zip(exact.positions[frame], seen.positions[frame], strict=True):
    still.plot(*np.transpose([true, found]), color="#d55e00", linewidth=1)
still.plot(*exact.positions[frame].T, "o", color="white", mec="black", markersize=4)
still.plot(*seen.positions[frame].T, "o", color="#d55e00", markersize=3)
x, y = (exact.positions[frame].min(axis=0) + exact.positions[frame].max(axis=0)) / 2
still.set(xlim=(x - 85, x + 85), ylim=(y + 140, y - 140))
still.axis("off")
for name, colour in (("left_wrist", "#0072b2"), ("right_knee", "#d55e00")):
    marker, label = MARKERS.index(name), name.replace("_", " ")
    over_time.plot(np.arange(90) / 30, error[:, marker], color=colour, label=label)
over_time.set(xlabel="time [s]", ylabel="error [pixels]", ylim=(0, None))
over_time.legend()
