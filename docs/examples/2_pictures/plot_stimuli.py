"""
How do I make point-light walkers for an experiment?
====================================================

A `motionenv.data.stimuli.StimulusSet` describes who walks and how that is displayed. Its settings, seeds included, fix
every dot, so another laboratory can make the same stimuli from the same file.
"""

import matplotlib.pyplot as plt

from motionenv.data.stimuli import Display, PointLightWalker, StimulusSet, frames_of

displays = {
    "upright": Display(view=45),
    "inverted": Display(view=45, inverted=True),
    "scrambled": Display(view=45, scrambled=True, seed=1),
    "masked": Display(view=45, mask=60, seed=7),
}
stimuli = StimulusSet(displays=list(displays.values()), seconds=1, fps=30, width=300, height=300)

# %%
# One frame of each. An inverted walker is upside down. In a scrambled one, each dot moves as before, but from a random
# place. The mask's dots move as those of scrambled walkers do, so only their order in space and time tells the walker's
# dots from them. ``write_stimuli(stimuli, "folder")`` writes films, tables of the dots, and the settings.

figure, axes = plt.subplots(1, 4, figsize=(9, 2.6), layout="constrained")
for axis, (title, display) in zip(axes, displays.items(), strict=True):
    frames = list(frames_of(stimuli, PointLightWalker(), display))
    axis.imshow(frames[0])
    axis.set(title=title, xticks=[], yticks=[])
