"""
What does an agent see?
=======================

WalkerTracking shows an agent one picture of 64 × 64 pixels per step, and asks for the position of every joint. Three
named tasks fix how hard that is. Easy: silhouettes of somebody in plain view. Medium: silhouettes of somebody who turns
and is hidden by objects. Hard: noisy colours, clutter, and a passer-by as well.
"""

import gymnasium
import matplotlib.pyplot as plt

import motionenv.envs

gymnasium.register_envs(motionenv.envs)

figure, axes = plt.subplots(3, 6, figsize=(9, 4.8), layout="constrained")
for row, level in zip(axes, ("Easy-v1", "Medium-v1", "Hard-v2"), strict=True):
    with gymnasium.make(f"motionenv/WalkerTracking-{level}") as env:
        seen, _ = env.reset(seed=3)
        for axis in row:
            axis.imshow(seen, cmap="gray")
            axis.set(xticks=[], yticks=[])
            for _ in range(12):
                seen, *_ = env.step(env.action_space.sample())
    row[0].set_ylabel(level.split("-")[0])
for i, axis in enumerate(axes[0]):
    axis.set_title(f"{12 * i / 30:.1f} s", fontsize="medium")
