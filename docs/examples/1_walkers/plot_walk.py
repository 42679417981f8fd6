"""
How do I get a walking person?
==============================

Each seed is another person, and the same seed gives the same walk on every machine.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.render import picture

people = [motionenv.synthesize("walk/fpca", seconds=1, fps=30, seed=seed) for seed in range(6)]
figure, axes = plt.subplots(1, 6, figsize=(9, 3), layout="constrained")
for axis, walk, seed in zip(axes, people, range(6), strict=True):
    axis.imshow(picture(walk, 12, np.radians(30), width=160, height=240))
    axis.set(title=f"seed {seed}", xlabel=f"{walk.skeleton.height:.2f} m", xticks=[], yticks=[])
