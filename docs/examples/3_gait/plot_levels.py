"""
How people differ, and how their strides do
===========================================

Somebody's strides differ less than people do. `MultilevelFPCA`, in the checkout's benchmarks, tells the two apart, also
where people have different numbers of strides, and strides have gaps. Here, fifteen people walk three times, a little
faster or slower each time, and are measured with errors of 1°.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from benchmarks.models.multilevel import MultilevelFPCA

rng = np.random.default_rng(0)
walks, labels = [], []
for person in range(15):
    for _ in range(3):
        speed = rng.uniform(1.0, 1.4)
        walk = motionenv.synthesize("walk/fpca", seconds=3 + rng.integers(3), fps=60, seed=person, speed=speed)
        walks.append(walk.angles + np.radians(1) * rng.standard_normal(walk.angles.shape))
        labels.append(f"person {person:02d}")
cycles = motionenv.segment(walks, fps=60, subjects=labels)
model = MultilevelFPCA(n_components=6).fit(cycles)
for level, share in zip(model.levels_, model.variance_ratio_, strict=True):
    print(f"{level}: {share:.0%} of the variance")
print(f"noise: {model.noise_ratio_:.0%}; intraclass correlation {model.icc_:.2f}")

# %%
# The first component of each level, two standard deviations to either side, and where in the cycle people differ more
# than their strides do: the intraclass correlation at each phase.

channel, percent = model.fpca_.channels_.index("left_knee_flexion"), np.arange(128) / 1.28
figure, axes = plt.subplots(1, len(model.levels_) + 1, figsize=(11, 3), layout="constrained")
mean = np.degrees(model.mean_[:, channel])
for axis, name, variance, components in zip(
    axes, model.levels_, model.explained_variance_, model.components_, strict=False
):
    step = np.degrees(2 * np.sqrt(variance[0]) * components[0][:, channel])
    axis.plot(percent, mean, color="black")
    axis.plot(percent, mean + step, color="C0")
    axis.plot(percent, mean - step, color="C1", linestyle="--")
    axis.set(xlabel="cycle [%]", ylabel="left knee flexion [°]", title=f"{name}: first component")
axes[-1].plot(percent, model.icc_curve_[:, channel], color="black")
axes[-1].set(xlabel="cycle [%]", ylim=(0, 1), title="intraclass correlation")

# %%
# What a few strides tell of a person is shrunk towards the mean, the more, the fewer they are. The band is where the
# person's own mean lies with 90 %.

one = np.flatnonzero(np.array(cycles.subject) == "person 03")[:1]
figure, axis = plt.subplots(figsize=(4, 3), layout="constrained")
for strides, colour in ((one, "C0"), (np.flatnonzero(np.array(cycles.subject) == "person 03"), "C1")):
    _, told = model.effects(cycles[strides])
    curve = np.degrees(model.mean_ + model.curves(told.means[0][0]))[:, channel]
    draws = rng.multivariate_normal(told.means[0][0], told.covariances[0][0], size=500)
    low, high = np.percentile(np.degrees(model.mean_ + model.curves(draws))[..., channel], (5, 95), axis=0)
    axis.fill_between(percent, low, high, color=colour, alpha=0.2, linewidth=0)
    axis.plot(percent, curve, color=colour, label=f"{len(strides)} stride{'s' * (len(strides) > 1)}")
axis.plot(percent, mean, color="black", linewidth=0.8, label="everybody")
axis.set(xlabel="cycle [%]", ylabel="left knee flexion [°]", title="person 03")
axis.legend(fontsize="small")
