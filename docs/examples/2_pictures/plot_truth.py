"""
What is known of every picture?
===============================

Colour, distance and the limb that each pixel shows come from one call, and agree with the camera exactly.
"""

import matplotlib.pyplot as plt

import motionenv
from motionenv.render import render

walk = motionenv.synthesize("walk/fpca", seconds=1, fps=30, seed=7)
places = motionenv.markers(walk.poses, walk.skeleton)  # (30, 15, 3) [m]
camera = motionenv.fit_view(places[15:16], alpha=0.6, width=240, height=320)
seen = render(walk.poses[15:16], walk.skeleton, camera)
pixels, _ = camera.project(places[15])

figure, axes = plt.subplots(1, 3, figsize=(8, 4), layout="constrained")
axes[0].imshow(seen.rgb[0])
axes[0].plot(*pixels.T, "o", color="white", markeredgecolor="black", markersize=4)
axes[0].set_title("colour, and 15 markers")
axes[1].imshow(seen.depth[0], cmap="viridis")
axes[1].set_title("distance [m]")
axes[2].imshow(seen.limbs[0], cmap="tab20")
axes[2].set_title("limbs")
for axis in axes:
    axis.axis("off")
