"""
C, fig. 3: what does the temperature do?
========================================

A motion tree draws the next pose from the windows of a database that resemble the last ten frames. The temperature β
says how closely they must. As in the paper, the history comes from the database itself, and ten poses are drawn at each
of four temperatures.

The paper's database holds motion capture, some 50,000 windows of professional dancers. Ours, ``mixed/tree``, holds
48,000 windows of walking that the shipped models synthesised, because no recordings may be shipped.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.body import EDGES
from motionenv.types import MARKERS

tree = motionenv.load("mixed/tree")
database = tree.database_
history = database.motion(20).poses[:60]
last = motionenv.markers(history[-1], database.skeleton)
pelvis = last[MARKERS.index("pelvis")]
temperatures, methods = (0.002, 0.05, 0.2, 1.0), ("tree", "exact")

figure = plt.figure(figsize=(7.5, 7), layout="constrained")
axes = figure.subplots(2, 4, sharex=True, sharey=True)
for row, method in zip(axes, methods, strict=True):
    for axis, temperature in zip(row, temperatures, strict=True):
        drawn = tree.sample(history, 10, temperature=temperature, seed=0, method=method)
        places = motionenv.markers(drawn.poses, database.skeleton)
        spread = np.linalg.norm(places - places.mean(axis=0), axis=-1).mean()
        print(f"{method:5} β = {temperature:<5g} spread {1000 * spread:.0f} mm per joint")
        for edge in EDGES:
            for pose in places - pelvis:
                axis.plot(*pose[list(edge)][:, [0, 2]].T, color="#0072b2", alpha=0.35)
            axis.plot(*(last - pelvis)[list(edge)][:, [0, 2]].T, color="black")
        axis.set(aspect="equal")
    row[0].set_ylabel(f"{method}\nheight above the pelvis [m]")
for axis, temperature in zip(axes[0], temperatures, strict=True):
    axis.set_title(f"β = {temperature:g}")
for axis in axes[1]:
    axis.set_xlabel("forward [m]")

# %%
# Black is the last pose of the history, blue are the ten next poses. Top: the paper's tree search. Bottom: exact draws
# from eq. 3, which the search approximates. As in the paper, a low temperature gives poses like the history's, and a
# high one spreads them towards everything in the database, which here is walking only. At the same temperature the tree
# spreads more than the exact draws.
