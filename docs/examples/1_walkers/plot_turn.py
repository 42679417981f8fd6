"""
How do I make somebody turn, stop and start?
============================================

Give ``path``, points to walk through, and ``speed``, rows of time and speed. The walker turns along a smooth curve,
stops and starts with whole steps, and stands still where the path ends.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.types import MARKERS

path = [(0, 0), (3, 0), (5, 2), (3, 4), (0, 3)]  # [m]
speed = [(0, 1.2), (4, 1.2), (5, 0), (6.5, 0), (7.5, 1.3)]  # [s], [m/s]
walk = motionenv.synthesize("walk/fpca", seconds=14, fps=60, seed=7, path=path, speed=speed)

# %%
# Left: the path of the pelvis, and where each foot stands. Where two prints are side by side, the walker stopped.
# Right: the speed of the pelvis changes within each step, and its mean over a step follows what was asked for. At the
# end of the path the walker stops, whatever was asked for.

places = motionenv.markers(walk.poses, walk.skeleton)[..., :2]
speeds = np.linalg.norm(np.gradient(places, 1 / walk.fps, axis=0), axis=-1)
time = np.arange(len(places)) / walk.fps
pelvis = MARKERS.index("pelvis")

figure, (above, over_time) = plt.subplots(1, 2, figsize=(9, 3.8), layout="constrained")
above.plot(*places[:, pelvis].T, color="0.6", label="pelvis")
for side, colour in (("left", "#0072b2"), ("right", "#d55e00")):
    ankle = MARKERS.index(f"{side}_ankle")
    stands = speeds[:, ankle] < 0.1
    above.plot(*places[stands, ankle].T, ".", color=colour, markersize=6, label=f"{side} foot")
above.plot(*np.transpose(path), "kx", label="path")
above.set(aspect="equal", xlabel="x [m]", ylabel="y [m]", title="from above")
above.legend(fontsize="small", loc="center left")
step = np.ones(33) / 33  # about 0.55 s
over_time.plot(time, speeds[:, pelvis], color="0.8", label="pelvis")
mean = np.convolve(speeds[:, pelvis], step, mode="valid")
over_time.plot(time[16:-16], mean, label="mean over a step")
over_time.plot(*np.transpose([*speed, (14, 1.3)]), "k--", label="asked for")
over_time.set(xlabel="time [s]", ylabel="speed [m/s]", title="over time", ylim=(0, 1.9))
over_time.legend(fontsize="small", loc="upper center", ncols=3)
