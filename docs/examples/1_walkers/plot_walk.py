"""
How do I get a walking person?
==============================

`motionenv.synthesize` returns a `motionenv.Motion`: a body, and 25 numbers per frame for the position and rotation of
its pelvis and its joint angles. Each seed is another person, with a body, a pace and a style of their own. The same
seed gives the same walk again.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.render import cameras, render

people = [motionenv.synthesize("walk/fpca", seconds=5, fps=30, seed=seed) for seed in range(6)]
print(f"poses of one person: {people[0].poses.shape}")

# %%
# The same camera sees each of them, so their heights can be compared. Below: body height and walking speed.

camera = cameras.view(np.radians(30), distance=5, width=150, height=250, fov_degrees=23)
figure, axes = plt.subplots(1, 6, figsize=(9, 3), layout="constrained")
for seed, (axis, walk) in enumerate(zip(axes, people, strict=True)):
    axis.imshow(render(walk.poses[0], walk.skeleton, camera, scene=motionenv.Scene(samples=2)).rgb)
    speed = (walk.poses[-1, 0] - walk.poses[0, 0]) / (walk.seconds - 1 / walk.fps)
    label = f"{walk.skeleton.height:.2f} m, {speed:.2f} m/s"
    axis.set_title(f"seed {seed}", fontsize="medium")
    axis.set_xlabel(label, fontsize="medium")
    axis.set(xticks=[], yticks=[])
