"""
What does an agent see?
=======================

Each named task fixes what makes tracking hard: silhouettes in plain view, people who turn behind occluders, colours
in clutter with somebody else about.
"""

import gymnasium
import matplotlib.pyplot as plt

figure, axes = plt.subplots(3, 6, figsize=(9, 4.8), layout="constrained")
for row, level in zip(axes, ("Easy", "Medium", "Hard"), strict=True):
    with gymnasium.make(f"motionenv/WalkerTracking-{level}-v1") as env:
        seen, _ = env.reset(seed=3)
        for axis in row:
            axis.imshow(seen, cmap="gray")
            axis.set(xticks=[], yticks=[])
            for _ in range(12):
                seen, *_ = env.step(env.action_space.sample())
    row[0].set_ylabel(level)
