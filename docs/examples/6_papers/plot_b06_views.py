"""
B, fig. 6: can the view be found, too?
======================================

Estimated over true view angle: mean and standard deviation. The paper finds it precisely, by either approach. Here:
80 people drawn from `walk/prior`, with its noise, make the model, and 20 others are looked at. On CMU's people, each
left out in turn, the mean error is 2.2° for least squares and 2.1° for MAP.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.lifting import find_view
from motionenv.models.eigenwalkers import FourierWalker

prior, rng = motionenv.load("walk/prior"), np.random.default_rng(1)
drawn = np.array([walker.coefficients for walker in prior.sample(100, seed=1)])
drawn += np.sqrt(prior.noise_)[..., None] * rng.standard_normal(drawn.shape)  # what components leave out
model = motionenv.Eigenwalkers(n_components=30).fit([FourierWalker(w, 1.0) for w in drawn[:80]])
walkers = drawn[80:]  # (20, 5, 15, 3) [m]
views = np.arange(-90, 91, 10)
figure, axes = plt.subplots(1, 2, figsize=(8, 3.8), layout="constrained", sharey=True)
for axis, approach, name in zip(axes, ("ls", "map"), ("I: least squares", "II: MAP"), strict=True):
    found = []
    for alpha in np.radians(views):
        seen = np.stack([walkers[..., :2] @ np.array((np.cos(alpha), np.sin(alpha))), walkers[..., 2]], axis=-1)
        off = find_view(model, seen, approach=approach).alpha - alpha
        found.append(np.degrees(alpha + np.mod(off + np.pi, 2 * np.pi) - np.pi))
    mean, deviation = np.mean(found, axis=1), np.std(found, axis=1)
    axis.plot(views, mean)
    axis.plot(views, mean - deviation, "C1--", views, mean + deviation, "C1--", linewidth=1)
    axis.plot(views, views, ":", color="0.5")
    axis.set(title=name, xlabel="true angle [°]", xticks=(-90, -45, 0, 45, 90), yticks=(-90, -45, 0, 45, 90))
    print(f"{name}: {np.mean(np.abs(np.array(found) - views[:, None])):.1f}° mean error")
axes[0].set_ylabel("angle found [°]")
