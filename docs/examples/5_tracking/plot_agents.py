"""
How good are simple agents?
===========================

Before you train an agent, know what it has to beat. `score` runs an agent on a named task and returns the mean error
per joint with a 95 % interval over episodes, here eight of them. The same eight seeds serve every agent.
"""

import matplotlib.pyplot as plt
import numpy as np

from motionenv.envs.agents import Blob, Kalman, MeanPose, score

levels = ("Easy", "Medium", "Hard")
agents = {"mean pose": MeanPose, "blob": Blob, "Kalman filter": Kalman}
tasks = [f"motionenv/WalkerTracking-{level}" for level in ("Easy-v1", "Medium-v1", "Hard-v2")]
reports = {name: [score(task, agent, episodes=8) for task in tasks] for name, agent in agents.items()}
print(" " * 19 + "Easy    Medium  Hard")
for name, results in reports.items():
    means = [f"{report['mean_error']:.2f} m" for report in results]
    print(f"{name:18}", "  ".join(means))

# %%
# The mean pose ignores the picture. The blob puts the mean pose where the silhouette is; the Kalman filter also
# remembers how the silhouette moved. In plain view (Easy) both are far better than the mean pose. Of somebody who walks
# behind things, in clutter and with a passer-by (Hard), they are off by a metre. The :doc:`leaderboard
# </made/leaderboard>` has more episodes, particle filters and trained networks.

figure, axis = plt.subplots(figsize=(7, 3.2), layout="constrained")
colours = ("0.5", "#0072b2", "#d55e00")
for i, (name, results) in enumerate(reports.items()):
    means = np.array([report["mean_error"] for report in results])
    low, high = np.transpose([report["error_interval"] for report in results])
    x, bars = np.arange(3) + 0.15 * (i - 1), (means - low, high - means)
    axis.errorbar(x, means, bars, fmt="o", color=colours[i], capsize=3, label=name)
axis.set(xticks=range(3), xticklabels=levels)
axis.set(ylabel="error per joint [m]", ylim=(0, None))
axis.grid(axis="y", alpha=0.3)
axis.legend(loc="upper left")
