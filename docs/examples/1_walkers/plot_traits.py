"""
How do I choose who walks?
==========================

Components have no names. Traits do: directions that change one measured feature of the walk most.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.render import picture

model = motionenv.load("walk/fpca")
traits = {trait.name: trait.direction for trait in model.traits()}
figure, axes = plt.subplots(2, len(traits), figsize=(9, 5), layout="constrained")
for column, (name, direction) in zip(axes.T, traits.items(), strict=True):
    for axis, amount in zip(column, (-3, 3), strict=True):
        walk = motionenv.synthesize(model, 1, 30, deviations=amount * np.asarray(direction), variation=0, phase=0)
        axis.imshow(picture(walk, 0, np.radians(60), width=150, height=230))
        axis.set(title=f"{name} {amount:+d}", xticks=[], yticks=[])
