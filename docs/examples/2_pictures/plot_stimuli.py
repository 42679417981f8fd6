"""
How do I make point-light walkers for an experiment?
====================================================

Upright, inverted, scrambled, and hidden among dots that move alike. The same file of settings makes the same dots in
another laboratory.
"""

import matplotlib.pyplot as plt

from motionenv.data.stimuli import Display, Person, StimulusSet, frames_of

displays = {
    "upright": Display(view=45),
    "inverted": Display(view=45, inverted=True),
    "scrambled": Display(view=45, scrambled=True, seed=1),
    "masked": Display(view=45, mask=60, seed=7),
}
asked = StimulusSet(displays=list(displays.values()), seconds=1, fps=30, width=300, height=300)
figure, axes = plt.subplots(1, 4, figsize=(9, 2.7), layout="constrained")
for axis, (title, display) in zip(axes, displays.items(), strict=True):
    frames = list(frames_of(asked, Person(), display))
    axis.imshow(frames[8])
    axis.set(title=title, xticks=[], yticks=[])
