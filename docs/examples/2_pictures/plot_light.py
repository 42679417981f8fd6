"""
How do I change light, clothes and ground?
==========================================

A `Scene` holds what isn't the walker. The truth doesn't change with it.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.render import picture

walk = motionenv.synthesize("walk/fpca", seconds=1, fps=30, seed=7)
scenes = {
    "as it is": motionenv.Scene(samples=2),
    "low sun": motionenv.Scene(samples=2, key=(0.9, 0.3, 0.25), key_light=(3.0, 2.2, 1.4), ambient=(0.2, 0.2, 0.25)),
    "other clothes": motionenv.Scene(samples=2, shirt=(0.7, 0.2, 0.2), trousers=(0.8, 0.75, 0.6)),
    "nothing below": motionenv.Scene(samples=2, ground=False, shadows=False),
}
figure, axes = plt.subplots(1, 4, figsize=(9, 3.4), layout="constrained")
for axis, (title, scene) in zip(axes, scenes.items(), strict=True):
    axis.imshow(picture(walk, 12, np.radians(40), width=200, height=260, scene=scene))
    axis.set(title=title, xticks=[], yticks=[])
