"""
What does a particle filter believe?
====================================

A thousand guesses, moved by what is known of walking and weighed by the silhouette. They spread where the picture
says little: in depth, and in the hidden arm.
"""

import gymnasium
import matplotlib.pyplot as plt
import numpy as np

import motionenv
import motionenv.envs
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.tracking import FPCAPrior, ParticleFilter, Start
from motionenv.types import MARKERS

env = gymnasium.make("motionenv/WalkerTracking-v1", observation="mask", size=128, horizon=45, actions="metric")
seen, _ = env.reset(seed=21)
truth = env.unwrapped.truth()
camera, body = truth["camera"], truth["skeleton"]
tracker = ParticleFilter(FPCAPrior(skeleton=body), SilhouetteLikelihood(camera, body), n=1000, seed=1)
tracker.start(Start.at(truth["pose"]))

figure, axes = plt.subplots(2, 4, figsize=(9, 4.8), layout="constrained")
for i in range(40):
    belief, true = tracker.step(mask=seen[..., 0]), env.unwrapped.truth()["pose"]
    if i % 10 == 9:
        column = axes[:, i // 10]
        places = motionenv.markers(belief.poses[::20], body)
        column[0].imshow(seen[..., 0], cmap="gray")
        column[0].plot(*camera.project(places.reshape(-1, 3))[0].T, ",", color="#d55e00")
        column[0].axis("off")
        wrist = MARKERS.index("left_wrist")
        column[1].plot(*places[:, wrist, 1:].T, ".", markersize=3, label="particles")
        column[1].plot(*motionenv.markers(true, body)[wrist, 1:], "k+", markersize=12, label="truth")
        column[1].set(aspect="equal", adjustable="datalim", xlabel="depth [m]", title=f"left wrist, frame {i + 1}")
    seen, *_ = env.step(belief.mean.astype(np.float32))
axes[1, 0].set_ylabel("height [m]")
axes[1, 0].legend(fontsize="small")
