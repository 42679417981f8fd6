"""
What is in a data set?
======================

A sample is a function of the specification, its seed and an index: nothing has to be stored to be had again.
"""

import matplotlib.pyplot as plt

from motionenv.data import Specification, Walkers

walkers = Walkers(
    Specification(
        frames=100_000, seed=3, people={"passers_by": (0, 2), "turning": 0.5},
        pictures={"background": "clutter", "light": "varied", "width": 160, "height": 160},
    )
)  # fmt: skip
figure, axes = plt.subplots(3, 6, figsize=(9, 4.8), layout="constrained")
for axis, index in zip(axes.ravel(), range(0, 90_000, 5_000), strict=True):
    sample = walkers[index]
    axis.imshow(sample["rgb"])
    seen = sample["visibility"] == 2
    axis.plot(*sample["pixels"][seen].T, ".", color="white", markersize=3)
    axis.axis("off")
