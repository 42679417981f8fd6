"""
How do I make a walker of my own capture?
=========================================

Read it, fit the body to it, and fit a model to everybody. The files are written here only so that this runs anywhere:
put your own in their place.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.render import picture

folder = TemporaryDirectory()
for person in range(6):
    walk = motionenv.synthesize("walk/fpca", seconds=6, fps=60, seed=person)
    motionenv.write(walk, Path(folder.name, f"{person}_01.bvh"))

# %%
# From here on as you would with files of your own.

files = sorted(Path(folder.name).glob("*.bvh"))
captured = [motionenv.retarget(motionenv.read(file)) for file in files]
model = motionenv.WalkingModel(n_components=4).fit(captured, subjects=[file.stem.split("_")[0] for file in files])

average = motionenv.synthesize(model, 2, 30, deviations=[], variation=0)
fresh = [motionenv.synthesize(model, 2, 30, seed=seed) for seed in (1, 2)]
figure, axes = plt.subplots(1, 4, figsize=(9, 3.6), layout="constrained")
shown = {"captured": captured[0], "average of all": average, "somebody new": fresh[0], "somebody else": fresh[1]}
for axis, (title, walk) in zip(axes, shown.items(), strict=True):
    axis.imshow(picture(walk, 10, np.radians(30), width=180, height=260))
    axis.set(title=title, xticks=[], yticks=[])
folder.cleanup()
