"""
Can people who turn be lifted?
==============================

Yes: points in pixels are fitted freely, frame by frame, so they may show anybody who walks, turns or runs. Besides 3D
positions, `lift` returns where the body faces in each frame, and the probability that each foot stands.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.body import EDGES
from motionenv.models.paths import WalkPath
from motionenv.types import MARKERS, Points

path = WalkPath.arc(radius=1.6, angle=9.0)
walk = motionenv.synthesize("walk/fpca", 5, 30, seed=4, path=path, speed=1.1)
truth = motionenv.markers(walk.poses, walk.skeleton)
camera = motionenv.fit_view(truth, 0.4, elevation=0.12)
pixels = camera.project(truth)[0] + np.random.default_rng(1).normal(0, 2, (150, 15, 2))
lifted = motionenv.lift(Points(pixels, 30, "px"), camera=camera)

pelvis = MARKERS.index("pelvis")
off = 1000 * (lifted.positions - truth)
print(f"error of the pelvis: {np.linalg.norm(off[:, pelvis], axis=-1).mean():.0f} mm")
about = np.linalg.norm(off - off[:, [pelvis]], axis=-1).mean()
print(f"error per joint, about the pelvis: {about:.0f} mm")

# %%
# Left: five of the 150 frames as the camera sees them, the first one darkest, with 2 pixels of noise. Middle: the path
# of the pelvis; the camera stands below the panel, at (1.9, -2.2) m. The error is mostly along its line of sight, where
# a single camera tells least. Right: when each foot stands.

figure = plt.figure(figsize=(9, 3.4), layout="constrained")
picture, above, feet = figure.subplots(1, 3, width_ratios=(1.5, 0.8, 1.5))
for frame in range(0, 150, 30):
    for edge in EDGES:
        picture.plot(*pixels[frame, list(edge)].T, color=plt.cm.viridis(frame / 140))
picture.set(title="what the camera saw", xlabel="x [pixels]", ylabel="y [pixels]")
picture.set(xlim=(0, 640), ylim=(480, 0), aspect="equal")
above.plot(*truth[:, pelvis, :2].T, "k--", label="truth")
above.plot(*lifted.positions[:, pelvis, :2].T, color="#0072b2", label="lifted")
above.set(title="from above", xlabel="x [m]", ylabel="y [m]", aspect="equal")
above.legend(fontsize="small", loc="center left")
for foot, (name, colour) in enumerate((("left", "#0072b2"), ("right", "#d55e00"))):
    feet.plot(np.arange(150) / 30, lifted.contact[:, foot], color=colour, label=name)
feet.set(title="does the foot stand?", xlabel="time [s]", ylabel="probability")
feet.set(ylim=(0, 1.2), yticks=(0, 0.5, 1))
feet.legend(fontsize="small", ncols=2, loc="upper center")
