"""
What do axes and angles mean?
=============================

x points forward, y to the left, z up, with the origin on the ground. A pose has 25 entries: three for the position of
the pelvis [m], and 22 angles [rad]. Each picture changes one angle of the pose in which all are 0. Flexion is forward
at the hip and the shoulder, and back at the knee; abduction is away from the body on either side.
"""

import textwrap

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.render import cameras, render
from motionenv.types import POSE

print(textwrap.fill(", ".join(POSE), 90))

# %%
# The camera stands to the right of the body, ahead of it.

body = motionenv.from_height(1.75)
camera = cameras.view(np.radians(35), distance=5, width=180, height=250, fov_degrees=25)
changes = {
    "left_hip_flexion": 40, "left_knee_flexion": 60, "left_elbow_flexion": 90,
    "left_shoulder_abduction": 70, "root_heading": 60,
}  # fmt: skip

figure, axes = plt.subplots(1, 6, figsize=(9, 2.65), layout="constrained")
for axis, (name, degrees) in zip(axes, {"all angles": 0, **changes}.items(), strict=True):
    pose = np.zeros(25)
    pose[POSE.index("root_z")] = 0.53 * body.height
    if name in POSE:
        pose[POSE.index(name)] = np.radians(degrees)
    axis.imshow(render(pose, body, camera, scene=motionenv.Scene(samples=2)).rgb)
    axis.set_title(f"{name}\n{degrees}°", fontsize="small")
    axis.axis("off")
for name, end, colour in zip("xyz", np.eye(3), ("#d62728", "#2ca02c", "#1f77b4"), strict=True):
    start, tip = camera.project(0.4 * np.array([0 * end, end]) + (-0.2, -0.6, 0))[0]
    axes[0].annotate("", tip, start, arrowprops={"color": colour, "arrowstyle": "->", "linewidth": 2})
    axes[0].text(*(tip + 0.25 * (tip - start)), name, color=colour, ha="center", va="center")
