"""
How do I choose who walks?
==========================

Give ``deviations``: standard deviations from the average person along each component of the model. Components have no
names, but traits do: a trait is the direction in which one measured feature of the walk changes most.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.render import picture

model = motionenv.load("walk/fpca")
traits = {trait.name: trait for trait in model.traits()}
for trait in traits.values():
    print(f"{trait.name:10} {trait.mean:.3f} {trait.unit} on average, {trait.gain:+.3f} per SD")

# %%
# Two standard deviations along each trait to either side of the average person. Bounce is left out, as a still doesn't
# show it. A trait changes whatever goes with its feature in the model, but not speed: all walk at the mean pace of
# people, unless ``speed=`` says otherwise.

views = {"arm swing": 0, "lean": 0, "sway": 90, "arm spread": 90, "step width": 90}  # degrees
figure, axes = plt.subplots(2, len(views), figsize=(7.2, 5.8), layout="constrained")
for column, (name, degrees) in zip(axes.T, views.items(), strict=True):
    trait = traits[name]
    for axis, amount, word in zip(column, (-2, 2), (trait.low, trait.high), strict=True):
        walk = motionenv.synthesize(model, 1, 30, deviations=amount * trait.direction, variation=0)
        axis.imshow(picture(walk, 0, np.radians(degrees), width=170, height=240))
        axis.set_title(f"{name} {amount:+d} SD:\n{word}", fontsize="medium")
        axis.set(xticks=[], yticks=[])
