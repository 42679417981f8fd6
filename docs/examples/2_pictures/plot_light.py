"""
How do I change light, clothes and ground?
==========================================

A `motionenv.Scene` sets light, clothes, ground and sky. Depth and limb ids don't depend on it.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.render import render

walk = motionenv.synthesize("walk/fpca", seconds=1, fps=30, seed=7)
places = motionenv.markers(walk.poses[0], walk.skeleton)
camera = motionenv.fit_view(places, np.radians(40), width=200, height=270, margin=0.14)
low_sun = {"key": (0.9, 0.3, 0.25), "key_light": (3.0, 2.2, 1.4), "ambient": (0.2, 0.2, 0.25)}
scenes = {
    "default": motionenv.Scene(samples=2),  # 2 x 2 rays per pixel: smooth edges
    "low sun": motionenv.Scene(samples=2, **low_sun),
    "other clothes": motionenv.Scene(samples=2, shirt=(0.7, 0.2, 0.2), trousers=(0.8, 0.75, 0.6)),
    "no ground": motionenv.Scene(samples=2, ground=False, shadows=False),
}
frames = {
    name: render(walk.poses[0], walk.skeleton, camera, scene=scene)
    for name, scene in scenes.items()
}  # fmt: skip
default = frames["default"]
same = all(
    np.array_equal(frame.depth, default.depth) and np.array_equal(frame.limbs, default.limbs)
    for frame in frames.values()
)
print(f"depth and limb ids are the same in all scenes: {same}")

figure, axes = plt.subplots(1, 4, figsize=(9, 3.4), layout="constrained")
for axis, (name, frame) in zip(axes, frames.items(), strict=True):
    axis.imshow(frame.rgb)
    axis.set(title=name, xticks=[], yticks=[])
