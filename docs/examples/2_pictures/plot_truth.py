"""
What is known of every picture?
===============================

`motionenv.render.render` returns colour, depth and the limb in each pixel. The camera that it takes also projects the
markers, so everything agrees.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.body import LIMBS
from motionenv.render import render

walk = motionenv.synthesize("walk/fpca", seconds=1, fps=30, seed=7)
places = motionenv.markers(walk.poses, walk.skeleton)  # (30, 15, 3) [m]
camera = motionenv.fit_view(places[0], alpha=0.6, width=240, height=320, margin=0.12)
frame = render(walk.poses[0], walk.skeleton, camera, scene=motionenv.Scene(samples=2))
pixels, _ = camera.project(places[0])

print(f"rgb {frame.rgb.shape}, depth {frame.depth.shape}, limbs {frame.limbs.shape}")
print(f"the walker covers {(frame.limbs > 0).mean():.1%} of the picture")
for name in ("head", "left_hand"):
    depth = frame.depth[frame.limbs == 1 + LIMBS.index(name)]
    print(f"{name}: {len(depth)} pixels, at {depth.min():.2f} to {depth.max():.2f} m")

# %%
# Left: the 15 markers, most of them joints inside the body. Middle: depth along the camera's axis, infinite where there
# is no body. Right: limb ids; 0 is the background, and others are 1 + the index into ``motionenv.body.LIMBS``.

figure, axes = plt.subplots(1, 3, figsize=(9, 3.9), layout="constrained")
axes[0].imshow(frame.rgb)
axes[0].plot(*pixels.T, "o", color="white", markeredgecolor="black", markersize=4)
near = axes[1].imshow(np.where(frame.limbs > 0, frame.depth, np.nan), cmap="viridis_r")
figure.colorbar(near, ax=axes[1], shrink=0.8)
axes[2].imshow(np.where(frame.limbs > 0, frame.limbs, np.nan), cmap="tab20", vmin=1, vmax=20)
for axis, title in zip(axes, ("colour and markers", "depth [m]", "limb ids"), strict=True):
    axis.set(title=title, xticks=[], yticks=[])
