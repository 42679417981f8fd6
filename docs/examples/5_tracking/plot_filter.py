"""
What does a particle filter believe?
====================================

A particle filter holds many guesses of the pose, here 1,000. `FPCAPrior` moves them as people walk, and
`SilhouetteLikelihood` weights them by how well they explain the picture. How far they spread says how sure it is.
"""

import gymnasium
import matplotlib.pyplot as plt
import numpy as np

import motionenv
import motionenv.envs
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.tracking import FPCAPrior, ParticleFilter, Start
from motionenv.types import MARKERS

settings = {"observation": "mask", "size": 128, "horizon": 45, "actions": "metric"}
env = gymnasium.make("motionenv/WalkerTracking-v1", **settings)
seen, _ = env.reset(seed=21)
truth = env.unwrapped.truth()
camera, body = truth["camera"], truth["skeleton"]
prior, likelihood = FPCAPrior(skeleton=body), SilhouetteLikelihood(camera, body)
tracker = ParticleFilter(prior, likelihood, n=1000, seed=1)
tracker.start(Start.at(truth["pose"]))

masks, particles, true = [], [], []
rng = np.random.default_rng(0)
for _ in range(40):
    belief = tracker.step(mask=seen[..., 0])
    drawn = rng.choice(1000, 200, p=np.exp(belief.log_weights))  # particles by weight
    masks.append(seen[..., 0])
    particles.append(motionenv.markers(belief.poses[drawn], body))
    true.append(env.unwrapped.truth()["joints"])
    seen, *_ = env.step(belief.mean.astype(np.float32))
particles, true = np.array(particles), np.array(true)
spread = 1000 * particles.std(axis=1).mean(axis=(0, 1))
print("standard deviation of joints:")
print("{:.0f} mm across, {:.0f} mm in depth, {:.0f} mm up".format(*spread))

# %%
# Top: particles over the silhouette that the filter sees. Bottom: particles of the two wrists, relative to their true
# places. The cloud is wider in depth, which a silhouette hardly shows, than up and down.

figure, axes = plt.subplots(2, 4, figsize=(9, 4.8), layout="constrained", sharey="row")
for (picture, panel), i in zip(axes.T, (9, 19, 29, 39), strict=True):
    picture.imshow(masks[i], cmap="gray")
    x, y = camera.project(particles[i].reshape(-1, 3))[0].T
    picture.plot(x, y, ",", color="#d55e00")
    picture.set_title(f"frame {i + 1}", fontsize="medium")
    picture.axis("off")
    for wrist, colour in (("left_wrist", "#0072b2"), ("right_wrist", "#e69f00")):
        off = 100 * (particles[i] - true[i])[:, MARKERS.index(wrist)]
        label = wrist.replace("_", " ")
        panel.plot(off[:, 1], off[:, 2], ".", color=colour, markersize=3, label=label)
    panel.plot(0, 0, "k+", markersize=12, label="truth")
    panel.set(xlim=(-25, 25), ylim=(-25, 25), aspect="equal", xlabel="depth [cm]")
axes[1, 0].set_ylabel("height [cm]")
axes[1, 0].legend(fontsize="small", loc="upper left", borderpad=0.2, handletextpad=0.1)
