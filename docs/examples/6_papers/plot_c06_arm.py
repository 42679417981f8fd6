"""
C, fig. 6: why does constant velocity lose an arm?
==================================================

Because its particles must cover every way in which an arm may go on, and few of them happen to go on as arms do. The
paper's example-based model tracks an arm with 300 particles, and constant velocity loses it, but not with 3,000.
Ours: the right arm of people who reach for something, 30 frames, six episodes; the tree holds other reaches. With 100
particles it is more exact than constant velocity with 3,000.
"""

import gymnasium
import matplotlib.pyplot as plt
import numpy as np

from motionenv.envs.agents import TrackingAgent, evaluate, truth_start
from motionenv.tracking import TreePrior, VelocityPrior, reaching_tree

tree = reaching_tree(seed=1)
env = gymnasium.make("motionenv/ArmTracking-v1", observation="mask", size=128, horizon=30, split="eval")
numbers = (10, 30, 100, 300, 1000, 3000)
priors = {
    "example-based": lambda world, _: TreePrior(tree, skeleton=world.truth()["skeleton"]),
    "constant velocity": lambda world, _: VelocityPrior(skeleton=world.truth()["skeleton"], part="right_arm"),
}
figure, axis = plt.subplots(figsize=(5.5, 3.6), layout="constrained")
for name, prior in priors.items():
    errors = [
        evaluate(env, TrackingAgent(env, prior, n=n, start=truth_start, seed=1), episodes=6, seed=3).errors.mean()
        for n in numbers
    ]
    axis.plot(numbers, 1000 * np.array(errors), "o-", label=name)
axis.set(xscale="log", xlabel="particles", ylabel="error of elbow and wrist [mm]", ylim=(0, None))
axis.legend()
