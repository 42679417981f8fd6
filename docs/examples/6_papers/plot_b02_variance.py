"""
B, fig. 2: how many eigenwalkers describe people?
=================================================

The paper's 80 people need 30 components for 95.5 % of the variance. Blue: the shipped model, of 11 captured people
(CMU), whose variance ten components hold completely. Orange: 80 people drawn from `walk/prior`, with the noise that
it learned from people left out.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.models.eigenwalkers import FourierWalker

prior, rng = motionenv.load("walk/prior"), np.random.default_rng(1)
drawn = np.array([walker.coefficients for walker in prior.sample(80, seed=1)])
drawn += np.sqrt(prior.noise_)[..., None] * rng.standard_normal(drawn.shape)  # what components leave out
models = {
    "11 captured people": motionenv.load("walk/eigenwalkers"),
    "80 drawn people": motionenv.Eigenwalkers().fit([FourierWalker(w, 1.0) for w in drawn]),
}
figure, axis = plt.subplots(figsize=(5.5, 3.6), layout="constrained")
for name, model in models.items():
    share = 100 * np.cumsum(model.explained_variance_ratio_)
    axis.plot(np.arange(1, len(share) + 1), share, ".-", label=name)
axis.plot(30, 95.5, "k+", markersize=12, label="paper: 80 captured people")
axis.set(xlabel="number of components", ylabel="cumulative variance [%]", ylim=(0, 102))
axis.legend()
