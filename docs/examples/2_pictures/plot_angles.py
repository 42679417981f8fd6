"""
What do axes and angles mean?
=============================

x is forward (red), y to the left (green), z up (blue). Each picture changes one angle of the pose in which all are 0:
flexion is forward for hips and shoulders, back for knees; abduction is away from the body, on either side.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.render import render
from motionenv.types import POSE

body = motionenv.from_height(1.75)
changed = {
    "zero": 0, "left_hip_flexion": 40, "left_knee_flexion": 60, "left_shoulder_abduction": 70, "root_heading": 60,
}  # fmt: skip
camera = motionenv.view(np.radians(35), distance=5, target=(0, 0, 0.85), width=240, height=320, fov_degrees=28)
figure, axes = plt.subplots(1, len(changed), figsize=(10, 3.2), layout="constrained")
for axis, (name, degrees) in zip(axes, changed.items(), strict=True):
    pose = np.zeros(25)
    pose[POSE.index("root_z")] = 0.53 * body.height
    if degrees:
        pose[POSE.index(name)] = np.radians(degrees)
    axis.imshow(render(pose, body, camera).rgb)
    for end, colour in zip(0.6 * np.eye(3), ("#d62728", "#2ca02c", "#1f77b4"), strict=True):
        axis.plot(*camera.project(np.array([(0, 0, 0), end]))[0].T, color=colour, linewidth=2)
    axis.set(title=f"{name} {degrees:+d}°" if degrees else "all 0", xticks=[], yticks=[])
    axis.title.set_fontsize("small")
