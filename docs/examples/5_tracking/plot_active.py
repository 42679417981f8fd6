"""
Where should the camera look?
=============================

ActiveTracking: people walk about among pillars, the camera sees a sixth of the square, and the agent turns it. What
isn't looked at becomes uncertain.
"""

import gymnasium
import matplotlib.pyplot as plt
import numpy as np

with gymnasium.make("motionenv/ActiveTracking-v0", people=3, render_mode="rgb_array") as env:
    env.reset(seed=4)
    beliefs = np.tile((5.0, 0.0, 4.0), (3, 1))  # x, y, standard deviation [m]
    figure, axes = plt.subplots(1, 3, figsize=(9, 3), layout="constrained")
    for axis in axes:
        for _ in range(12):
            env.step(env.unwrapped.action(np.concatenate([(1.0, 0.0, 0.0), beliefs.ravel()])))  # pan to the left
        axis.imshow(env.render())
        axis.axis("off")
