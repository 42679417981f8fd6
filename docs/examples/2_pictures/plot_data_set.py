"""
What is in a data set?
======================

A `motionenv.data.Specification` says who walks, what the cameras see, and how the pictures look. Each sample follows
from it and an index alone, so any sample can be made again at any time, on its own.
"""

import matplotlib.pyplot as plt
import numpy as np

from motionenv.data import Specification, Walkers

specification = Specification(
    frames=100_000,
    seed=3,
    people={"passers_by": (0, 2), "turning": 0.5},
    pictures={"background": "clutter", "light": "varied", "width": 180, "height": 180},
)
walkers = Walkers(specification)
sample = walkers[5_000]
for name, value in sample.items():
    print(f"{name}: {np.shape(value)}")

again = Walkers(specification)[5_000]
print(f"the same picture when made again: {np.array_equal(again['rgb'], sample['rgb'])}")

# %%
# Twelve of the 100,000 pictures, with up to two passers-by. Visible joints of the walker are white; those hidden by the
# walker's own body or by a passer-by are orange.

figure, axes = plt.subplots(2, 6, figsize=(9, 3.1), layout="constrained")
for axis, index in zip(axes.ravel(), range(0, 60_000, 5_000), strict=True):
    sample = walkers[index]
    axis.imshow(sample["rgb"])
    for visibility, colour in ((1, "#ff9f1c"), (2, "white")):
        joints = sample["pixels"][sample["visibility"] == visibility]
        axis.scatter(*joints.T, s=9, c=colour, edgecolors="black", linewidths=0.4)
    axis.axis("off")
