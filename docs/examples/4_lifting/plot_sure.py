"""
How sure is a lifted walk?
==========================

Each coordinate comes with the half-width of an interval that shall hold the truth 90 % of the time. Whether it does
can be counted, here for 30 people whom the prior hasn't seen.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.lifting import lift, project_markers
from motionenv.types import MARKERS, Markers

errors, bands = [], []
for seed in range(30):
    walk = motionenv.synthesize("walk/fpca", seconds=4, fps=30, seed=seed)
    truth = motionenv.markers(walk.poses, walk.skeleton)
    lifted = lift(project_markers(Markers(MARKERS, truth, 30), alpha=np.radians(30)), alpha=np.radians(30))
    away = np.array((-np.sin(np.radians(30)), np.cos(np.radians(30)), 0))  # the direction that isn't seen
    off = (lifted.positions - truth) @ away
    errors.append(np.abs(off - off[:, [MARKERS.index("pelvis")]]))  # parallel rays don't say how far away she is
    bands.append(np.abs(lifted.band @ np.abs(away)))
errors, bands = np.array(errors), np.array(bands)
inside = (errors <= bands).mean(axis=(0, 1))
order = np.argsort(errors.mean(axis=(0, 1)))
figure, (size, share) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained", sharey=True)
names = [MARKERS[i].replace("_", " ") for i in order]
size.barh(names, 1000 * errors.mean(axis=(0, 1))[order], label="mean error of depth")
size.plot(1000 * bands.mean(axis=(0, 1))[order], names, "k|", markersize=12, label="mean half-width")
size.set(xlabel="[mm]")
size.legend()
share.barh(names, 100 * inside[order])
share.axvline(90, color="black")
share.set(xlabel="inside the interval [%]", xlim=(0, 100))
