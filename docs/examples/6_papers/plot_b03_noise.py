"""
B, fig. 3: how much noise should be assumed?
============================================

The error in the missing dimension over the variance σ² that MAP assumes. In the paper (80 people, leave-one-out) the
best is 70 mm². On CMU's 11 people, each left out in turn, it is flat from 125 to 400 mm². Here: 80 people drawn from
`walk/prior` make the model, 20 others are lifted. They differ by its noise, too, which tells how people whom it was
not fitted to differ from what its components say, and more than the paper's people do.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.lifting import maximum_a_posteriori
from motionenv.models.eigenwalkers import FourierWalker

prior, rng = motionenv.load("walk/prior"), np.random.default_rng(1)
drawn = np.array([walker.coefficients for walker in prior.sample(100, seed=1)])
drawn += np.sqrt(prior.noise_)[..., None] * rng.standard_normal(drawn.shape)  # what components leave out
model = motionenv.Eigenwalkers(n_components=30).fit([FourierWalker(w, 1.0) for w in drawn[:80]])
walkers = drawn[80:]  # (20, 5, 15, 3) [m]
variances = np.array((1, 2, 5, 10, 20, 40, 70, 100, 150, 250, 400, 625)) * 1e-6  # [m²]
views = np.radians(np.arange(-90, 91, 15))


def error(alpha: float, variance: float) -> float:
    """E_a of eq. 4.2 [mm²]: mean squared error over a cycle in the dimension that the view doesn't show."""
    across, away = (np.array((np.cos(alpha), np.sin(alpha))), np.array((-np.sin(alpha), np.cos(alpha))))
    seen = np.stack([walkers[..., :2] @ across, walkers[..., 2]], axis=-1)
    off = maximum_a_posteriori(model, seen, alpha, variance=variance).depth - walkers[..., :2] @ away
    return 1e6 * (off[:, 0] ** 2 + 0.5 * (off[:, 1:] ** 2).sum(axis=1)).mean()


errors = [np.mean([error(alpha, variance) for alpha in views]) for variance in variances]
figure, axis = plt.subplots(figsize=(5.5, 3.4), layout="constrained")
axis.plot(1e6 * variances, errors, "o-")
axis.axvline(70, color="0.6", linestyle="--", label="best in the paper")
axis.set(xlabel="σ² [mm²]", ylabel="error of depth [mm²]", ylim=(0, None))
axis.legend()
