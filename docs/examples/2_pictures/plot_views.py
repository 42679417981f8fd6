"""
What does a view angle mean?
============================

At 0° the camera is to the right of the walker, who walks to the right in the picture. At 90° it is in front, at 180° to
the left, and at -90° behind. This is the view angle α of paper B (equation B.2): the picture's horizontal axis is
cos α·x + sin α·y. Elevation is the angle by which the camera looks down.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.render import picture

walk = motionenv.synthesize("walk/fpca", seconds=1, fps=30, seed=7)
figure, axes = plt.subplots(2, 6, figsize=(9, 5.1), layout="constrained")
for row, elevation in zip(axes, (0, 30), strict=True):
    row[0].set_ylabel(f"elevation {elevation}°")
    for axis, angle in zip(row, (0, 45, 90, 135, 180, -90), strict=True):
        alpha, down = np.radians((angle, elevation))
        axis.imshow(picture(walk, 0, alpha, elevation=down, width=150, height=240))
        axis.set(title=f"{angle}°", xticks=[], yticks=[])
