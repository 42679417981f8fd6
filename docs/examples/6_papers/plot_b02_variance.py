"""
B, fig. 2: how many eigenwalkers describe people?
=================================================

Each eigenwalker is a direction in which walkers differ. The figure shows how much of the variance between people the
leading ones explain together. In the paper, 30 of them explain 95.5 % for 80 captured people (cross).

Blue: the shipped model was fitted to 11 people, so its ten components explain all of their variance. Ten aren't
enough for a twelfth person, though. Orange: 80 people drawn from ``walk/prior``, a model of the same recordings that
also has a noise, learned by cross-validation on people left out. Their variance takes more components than the
paper's.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.models.eigenwalkers import FourierWalker

prior, rng = motionenv.load("walk/prior"), np.random.default_rng(1)
drawn = np.array([walker.coefficients for walker in prior.sample(80, seed=1)])
drawn += np.sqrt(prior.noise_)[..., None] * rng.standard_normal(drawn.shape)
people = [FourierWalker(coefficients, frequency=1.0) for coefficients in drawn]
models = {
    "11 captured people": motionenv.load("walk/eigenwalkers"),
    "80 drawn people": motionenv.Eigenwalkers(n_components=30).fit(people),
}

figure, axis = plt.subplots(figsize=(6.5, 3.6), layout="constrained")
for name, model in models.items():
    share = 100 * np.cumsum(model.explained_variance_ratio_)
    axis.plot(np.arange(1, len(share) + 1), share, ".-", label=name)
    print(f"{name}: {share[-1]:.1f} % in {len(share)} components")
paper = "80 captured people (paper)"
axis.plot(30, 95.5, "k+", markersize=12, markeredgewidth=2, label=paper)
axis.set(xlabel="number of components", ylabel="cumulative variance [%]", ylim=(0, 104))
axis.set_title("Variance explained by eigenwalkers")
axis.legend()

# %%
# Other captured people, 99 walkers recorded by a depth camera, have 96.9 % of their variance in 30 components
# (``models.eigenwalkers`` in the :doc:`results </made/results>`).
