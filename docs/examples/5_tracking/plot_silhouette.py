"""
How does a particle filter see a silhouette?
============================================

As a score of each pose: how probable the pixels are if that pose were true. Seen from the side, it tells where
somebody is to the centimetre, less so how far away; and a leg may as well be where the other one is: the second peak.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.render import render
from motionenv.types import POSE

walk = motionenv.synthesize("walk/fpca", seconds=1, fps=30, seed=7)
camera = motionenv.fit_view(motionenv.markers(walk.poses, walk.skeleton), alpha=0, width=128, height=128)
true = walk.poses[20]
seen = render(true, walk.skeleton, camera).limbs > 0
likelihood = SilhouetteLikelihood(camera, walk.skeleton)
likelihood.observe(mask=seen.reshape(128, 128))

figure, (picture, *panels) = plt.subplots(1, 4, figsize=(11, 3), layout="constrained")
picture.imshow(seen.reshape(128, 128), cmap="gray")
picture.axis("off")
for axis, name, unit, reach in zip(
    panels, ("root_x", "root_y", "left_hip_flexion"), ("cm", "cm", "°"), (0.3, 0.3, 0.9), strict=True
):
    change = np.linspace(-reach, reach, 201)
    poses = np.tile(true, (201, 1))
    poses[:, POSE.index(name)] += change
    axis.plot(np.degrees(change) if unit == "°" else 100 * change, likelihood.log_likelihood(poses))
    axis.set(xlabel=f"{name.replace('_', ' ')}: off by [{unit}]")
panels[0].set_ylabel("log likelihood")
