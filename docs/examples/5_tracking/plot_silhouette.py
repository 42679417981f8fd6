"""
What does a silhouette say about a pose?
========================================

`SilhouetteLikelihood` scores any pose by how probable the pixels would be if that pose were true. Here one number of
the true pose is changed at a time: the place along the picture, the place in depth, and the flexion of one hip.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.render import render
from motionenv.types import POSE

walk = motionenv.synthesize("walk/fpca", seconds=1, fps=30, seed=7)
joints = motionenv.markers(walk.poses, walk.skeleton)
camera = motionenv.fit_view(joints, alpha=0, width=128, height=128)
true = walk.poses[20]
mask = (render(true, walk.skeleton, camera).limbs > 0).reshape(128, 128)
likelihood = SilhouetteLikelihood(camera, walk.skeleton)
likelihood.observe(mask=mask)


def scores(name: str, changes: np.ndarray) -> np.ndarray:
    """Log likelihood, relative to the true pose, after changes of one number."""
    poses = np.tile(true, (len(changes), 1))
    poses[:, POSE.index(name)] += changes
    return likelihood.log_likelihood(poses) - likelihood.log_likelihood(true[None])


# %%
# A few centimetres to the side make the pose far less likely. The same distance in depth matters much less, because the
# figure only grows or shrinks a little. The hip has a second, lower peak, where the left leg lies over the right one.
# Such peaks are why a filter keeps many guesses rather than the best one.

places = {"root_x": "to the side", "root_y": "in depth"}
for name, label in places.items():
    print(f"5 cm {label}: log likelihood {scores(name, np.array([0.05]))[0]:.1f}")

figure, (picture, *panels) = plt.subplots(1, 4, figsize=(9, 2.8), layout="constrained")
picture.imshow(mask, cmap="gray")
picture.axis("off")
change = np.linspace(-0.3, 0.3, 201)
for axis, (name, label) in zip(panels, places.items(), strict=False):
    axis.plot(100 * change, scores(name, change), color="#0072b2")
    axis.set(xlabel=f"off {label} [cm]", ylim=(-25, 1))
angle = np.radians(np.linspace(-50, 60, 201))
panels[2].plot(np.degrees(angle), scores("left_hip_flexion", angle), color="#0072b2")
panels[2].set(xlabel="left hip flexion off [°]", ylim=(-25, 1))
panels[0].set_ylabel("log likelihood\n(0: the true pose)")
