"""
How good are simple agents?
===========================

The error per joint in three tasks, with 95 % intervals over eight episodes. The mean pose knows nothing of the
picture; the blob follows what moves. The leaderboard has trained ones.
"""

import matplotlib.pyplot as plt
import numpy as np

from motionenv.envs.agents import Blob, ConstantVelocity, MeanPose, score

levels, agents = ("Easy", "Medium", "Hard"), (MeanPose, ConstantVelocity, Blob)
figure, axis = plt.subplots(figsize=(6, 3.2), layout="constrained")
for i, agent in enumerate(agents):
    reports = [score(f"motionenv/WalkerTracking-{level}-v1", agent, episodes=8) for level in levels]
    means = np.array([report["mean_error"] for report in reports])
    low, high = np.transpose([report["error_interval"] for report in reports])
    axis.bar(np.arange(3) + 0.27 * (i - 1), means, 0.25, yerr=(means - low, high - means), label=agent.__name__)
axis.set(xticks=range(3), xticklabels=levels, ylabel="error per joint [m]")
axis.legend(loc="upper left")
