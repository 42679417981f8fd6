"""
How can a walk be explored in Rerun?
====================================

The viewer of `Rerun <https://rerun.io>`_ shows points, pictures and curves on one timeline. Its SDK (``pip install
rerun-sdk``) takes motionenv's arrays as they are: both are in metres, with z up. `rerun walk.rrd` then opens the file.
"""

import tempfile

import matplotlib.pyplot as plt
import numpy as np
import rerun as rr

import motionenv
from motionenv.body import EDGES
from motionenv.render import render

walk = motionenv.synthesize("walk/fpca", seconds=2, fps=30, seed=7)
points = motionenv.markers(walk.poses, walk.skeleton)  # (60, 15, 3) [m]
camera = motionenv.fit_view(points, alpha=0.6, width=320, height=240)
frame = render(walk.poses, walk.skeleton, camera)

log = rr.RecordingStream("motionenv")
log.save(f"{tempfile.mkdtemp()}/walk.rrd")  # or log.spawn() for a live viewer
log.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
log.log("world/camera", rr.Transform3D(translation=camera.centre, mat3x3=camera.R.T), static=True)
K = camera.K + np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])  # Rerun counts pixels from the corner of the first
log.log("world/camera", rr.Pinhole(image_from_camera=K, resolution=[320, 240]), static=True)
for i in range(len(points)):
    log.set_time("time", duration=i / walk.fps)
    log.log("world/markers", rr.Points3D(points[i], labels=list(motionenv.types.MARKERS), radii=0.015))
    log.log("world/skeleton", rr.LineStrips3D(points[i][np.array(EDGES)]))
    log.log("world/camera/picture", rr.Image(frame.rgb[i]).compress(jpeg_quality=95))
    log.log("left_knee_flexion", rr.Scalars(np.degrees(walk.poses[i, motionenv.types.POSE.index("left_knee_flexion")])))
log.disconnect()

# %%
# What the viewer shows of one moment: the picture, and the skeleton projected into it.

pixels, _ = camera.project(points[20])
figure, axis = plt.subplots(figsize=(5, 3.75), layout="constrained")
axis.imshow(frame.rgb[20])
axis.plot(*pixels[np.array(EDGES)].transpose(2, 1, 0), "o-", color="white", markeredgecolor="black", markersize=4)
axis.set(xticks=[], yticks=[])
