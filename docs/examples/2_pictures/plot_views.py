"""
What does a view angle mean?
============================

0° looks at the walker's side, 90° at the front, as in paper B (Zhang & Troje 2007). The camera looks down by the
elevation.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.render import picture

walk = motionenv.synthesize("walk/fpca", seconds=1, fps=30, seed=7)
figure, axes = plt.subplots(2, 6, figsize=(9, 4.6), layout="constrained")
for row, elevation in zip(axes, (0, 30), strict=True):
    for axis, angle in zip(row, (0, 45, 90, 135, 180, 270), strict=True):
        shown = picture(walk, 0, np.radians(angle), elevation=np.radians(elevation), width=150, height=230)
        axis.imshow(shown)
        axis.set(title=f"{angle}°, from {elevation}° above" if elevation else f"{angle}°", xticks=[], yticks=[])
        axis.title.set_fontsize("small")
