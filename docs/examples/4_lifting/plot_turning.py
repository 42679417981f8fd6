"""
Can people who turn be lifted?
==============================

Points in pixels may show anybody who walks, turns or runs. Each frame has its own heading, and each foot a
probability that it stands.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.models.paths import Path
from motionenv.render.cameras import fit_view
from motionenv.types import MARKERS, Points

walk = motionenv.synthesize("walk/fpca", seconds=5, fps=30, seed=4, path=Path.arc(1.6, 9.0), speed=1.1)
truth = motionenv.markers(walk.poses, walk.skeleton)
camera = fit_view(truth, 0.4, elevation=0.12)
pixels = camera.project(truth)[0] + np.random.default_rng(1).normal(0, 2, (150, 15, 2))
lifted = motionenv.lift(Points(pixels, 30, "px"), camera=camera)

figure, (picture, above, feet) = plt.subplots(1, 3, figsize=(10, 3.4), layout="constrained")
picture.plot(*pixels.reshape(-1, 2).T, ".", markersize=1)
picture.set(title="what the camera saw", xlim=(0, 640), ylim=(480, 0), aspect="equal")
for places, style, name in ((truth, "k--", "truth"), (lifted.positions, "C0", "lifted")):
    above.plot(*places[:, MARKERS.index("pelvis"), :2].T, style, label=name)
above.set(title="from above", xlabel="x [m]", ylabel="y [m]", aspect="equal")
above.legend()
feet.plot(np.arange(150) / 30, lifted.contact, label=("left", "right"))
feet.set(title="probability that a foot stands", xlabel="time [s]")
feet.legend()
