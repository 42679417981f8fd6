"""
How do I make a walker of my own capture?
=========================================

Read the files, fit motionenv's body to each with `motionenv.retarget`, and fit a model to all of them. To run anywhere,
this example writes six walks as BVH files first; put your own capture in their place.
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
# From here on, do as you would with files of your own. ``subjects`` says whose walk each is.

files = sorted(Path(folder.name).glob("*.bvh"))
captured = [motionenv.retarget(motionenv.read(file)) for file in files]
people = [file.stem.split("_")[0] for file in files]
model = motionenv.WalkingModel(n_components=4).fit(captured, subjects=people)
print(f"{len(files)} walks of {captured[0].seconds:.0f} s at {captured[0].fps:.0f} frames/s")

# %%
# New people can be drawn from the model. ``model.save`` writes it to a file, which works wherever a model's name does.

shown = {
    "captured": captured[0],
    "average of all": motionenv.synthesize(model, 2, 30, deviations=[], variation=0),
    "drawn, seed 1": motionenv.synthesize(model, 2, 30, seed=1),
    "drawn, seed 2": motionenv.synthesize(model, 2, 30, seed=2),
}
figure, axes = plt.subplots(1, 4, figsize=(9, 3.6), layout="constrained")
for axis, (title, walk) in zip(axes, shown.items(), strict=True):
    axis.imshow(picture(walk, 0, np.radians(30), width=180, height=260))
    axis.set(title=title, xticks=[], yticks=[])
folder.cleanup()
