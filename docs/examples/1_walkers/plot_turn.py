"""
How do I make somebody turn, stop and start?
============================================

Give points to go through, and a speed that changes with the time. Feet stay where they stand, and who reaches the end
of the way stops there.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.body import markers
from motionenv.types import MARKERS

way = [(0, 0), (3, 0), (5, 2), (3, 4), (0, 3)]
speed = [(0, 1.2), (4, 1.2), (5, 0), (6.5, 0), (7.5, 1.3)]  # rows of time [s] and speed [m/s]
walk = motionenv.synthesize("walk/fpca", seconds=13, fps=60, seed=7, path=way, speed=speed)
places = markers(walk.poses, walk.skeleton)

figure, (above, over_time) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
for name, colour in (("left_ankle", "#0072b2"), ("right_ankle", "#d55e00"), ("pelvis", "0.4")):
    above.plot(*places[:, MARKERS.index(name), :2].T, color=colour, label=name.replace("_", " "))
above.plot(*np.array(way).T, "kx", label="points to go through")
above.set(aspect="equal", xlabel="x [m]", ylabel="y [m]", title="from above")
above.legend(fontsize="small")
pelvis = places[:, MARKERS.index("pelvis"), :2]
over_time.plot(np.arange(len(pelvis) - 1) / 60, np.linalg.norm(np.diff(pelvis, axis=0), axis=1) * 60)
over_time.plot(*np.array([*speed, (13, 1.3)]).T, "k--", label="asked")
over_time.set(xlabel="time [s]", ylabel="speed [m/s]", title="people sway: speed changes with each step")
over_time.legend()
