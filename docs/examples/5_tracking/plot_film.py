"""
How do I track somebody in a film?
==================================

Call `track_video` on a film from a camera that stands still. It detects people (`pip install 'motionenv[detect]'`),
estimates the background, guesses the camera, and follows the lifted motion and the silhouette with a particle filter.
The body height is optional; without it and without a camera, 1.75 m is assumed.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.render import film
from motionenv.tracking import track_video

walk = motionenv.synthesize("walk/fpca", seconds=2, fps=15, seed=21, height=1.75)
frames = list(film(walk, width=192, height=144, follow=False))
with TemporaryDirectory() as folder:
    path = Path(folder, "passing.mp4")
    motionenv.write_video(path, frames, walk.fps)
    track = track_video(path, height=1.75, particles=300, seed=1)

found = motionenv.markers(track.motion.poses, track.motion.skeleton)
true = motionenv.markers(walk.poses, walk.skeleton)
pelvis = motionenv.types.MARKERS.index("pelvis")
off = (found - found[:, [pelvis]]) - (true - true[:, [pelvis]])
print(f"{track.followed.sum()} of {len(frames)} frames followed")
error = 1000 * np.nanmean(np.linalg.norm(off, axis=-1))
print(f"error per joint, about the pelvis: {error:.0f} mm")

# %%
# The expected joints in three frames, and the overlap of the expected silhouette with the walker's outline (1 is
# perfect). Where the figure doesn't fit, the frame is reported as lost, and its pose is NaN.

figure = plt.figure(figsize=(9, 4.4), layout="constrained")
axes = figure.subplot_mosaic("abc;ddd", height_ratios=(1.8, 1))
for axis, i in zip("abc", (5, 15, 25), strict=True):
    axes[axis].imshow(frames[i])
    x, y = track.camera.project(found[i])[0].T
    axes[axis].plot(x, y, ".", color="#d55e00", markersize=5)
    axes[axis].set_title(f"{i / walk.fps:.1f} s", fontsize="medium")
    axes[axis].axis("off")
axes["d"].plot(np.arange(len(frames)) / walk.fps, track.overlap, color="#0072b2")
axes["d"].set(xlabel="time [s]", ylabel="overlap", xlim=(0, None), ylim=(0, 1))
