"""
How do I track somebody in a film?
==================================

From a camera that stands still, and nothing else: the background is estimated, the walker found, the first pose too.
Frames in which the figure doesn't fit say so.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt

import motionenv
from motionenv.render import film
from motionenv.tracking import track_video

folder = TemporaryDirectory()
path = Path(folder.name, "passing.mp4")
walk = motionenv.synthesize("walk/fpca", seconds=2, fps=15, seed=21, height=1.75)
frames = list(film(walk, width=192, height=144, follow=False))
motionenv.write_video(path, frames, walk.fps)
track = track_video(path, height=1.75, particles=300, attempts=1, seed=1)
folder.cleanup()

figure, axes = plt.subplots(1, 4, figsize=(9, 2), layout="constrained", width_ratios=(1, 1, 1, 1.4))
for axis, i in zip(axes[:3], (5, 15, 25), strict=True):
    axis.imshow(frames[i])
    places = motionenv.markers(track.motion.poses[i], track.motion.skeleton)
    axis.plot(*track.camera.project(places)[0].T, ".", color="#d55e00", markersize=3)
    axis.axis("off")
axes[3].plot(track.overlap)
axes[3].set(xlabel="frame", ylabel="overlap", ylim=(0, 1))
