"""
A, figs. 9 and 10: how do people differ, and how does one person vary?
======================================================================

Principal components about the mean of all cycles describe how people differ (the paper's fig. 9). Components about
each person's own mean describe how one person's cycles vary (fig. 10). The mean cycle is grey, with two standard
deviations along a component to either side. The paper gives each joint angle its own singular values, so we fit each
angle alone.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv

seeds = range(40)
walks = [motionenv.synthesize("walk/fpca", 10, fps=60, seed=seed) for seed in seeds]
names = [str(seed) for seed in seeds]
cycles = motionenv.segment([walk.angles for walk in walks], fps=60, subjects=names)
phase = np.linspace(0, 1, 101)

figure, axes = plt.subplots(2, 4, figsize=(9, 4.4), sharex=True, sharey="row")
figure.set_layout_engine("constrained")
views = {"all": "between people", "subject": "within a person"}
for row, name in zip(axes, ("left_hip_flexion", "left_elbow_flexion"), strict=True):
    row[0].set_ylabel(f"{name.replace('_', ' ')} [°]")
    for pair, (centre, title) in enumerate(views.items()):
        fpca = motionenv.FunctionalPCA(4, centre=centre).fit(cycles, channels=[name])
        values = np.degrees(fpca.singular_values_).astype(int)
        print(f"{name}, {title}: singular values", *values)
        for k, axis in enumerate(row[2 * pair : 2 * pair + 2]):
            scores = np.zeros((3, 1, 4))
            scores[1:, 0, k] = np.array((2, -2)) * np.sqrt(fpca.explained_variance_[k])
            mean, plus, minus = np.degrees(fpca.evaluate(scores, phase))[..., 0]
            axis.plot(100 * phase, mean, color="0.6")
            axis.plot(100 * phase, plus, color="C0", label="+ 2 SD")
            axis.plot(100 * phase, minus, color="C1", linestyle="--", label="- 2 SD")
            if axis in axes[0]:
                axis.set_title(f"{title}\ncomponent {k + 1}", fontsize="medium")
for axis in axes[1]:
    axis.set_xlabel("cycle [%]")
axes[0, 0].legend(fontsize="small", loc="upper center")

# %%
# Singular values grow with the number of cycles, so only their ratios can be compared with the paper's, which come
# from two walks of each of four people. There, the hip's first singular value falls from 892 between people to 498
# within them, and the elbow's rises from 632 to 699. (Without gaps it couldn't rise, as removing each person's mean
# only removes variance.) Ours fall in both, and by more: compared with how they differ from each other, synthesised
# people vary less from cycle to cycle than the paper's.
