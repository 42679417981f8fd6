"""
C, fig. 3: what does the temperature do?
========================================

Ten next poses, drawn at four temperatures: near 0 only what followed the most similar window, at 1 almost anything.
The paper's database holds dancers (50,000 windows); ours, `mixed/tree`, walkers that the shipped models make.
"""

import matplotlib.pyplot as plt

import motionenv
from motionenv.body import EDGES

tree = motionenv.load("mixed/tree")
history = motionenv.synthesize("walk/fpca", seconds=2, fps=30, seed=10, speed=1.3)
last = motionenv.markers(history.poses[-1], history.skeleton)
figure, axes = plt.subplots(1, 4, figsize=(9, 3.6), layout="constrained", sharey=True)
for axis, temperature in zip(axes, (0.002, 0.05, 0.2, 1.0), strict=True):
    drawn = tree.sample(history, 10, temperature=temperature, seed=0, method="exact").poses
    places = motionenv.markers(drawn, history.skeleton)
    for a, b in EDGES:
        for sample in places:
            axis.plot(*(sample[[a, b]] - last[0])[:, (0, 2)].T, "C0", alpha=0.4)
        axis.plot(*(last[[a, b]] - last[0])[:, (0, 2)].T, "k")
    axis.set(aspect="equal", title=f"β = {temperature:g}", xlabel="forward [m]")
axes[0].set_ylabel("up from the head [m]")
