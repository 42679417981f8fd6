"""
Do two groups walk differently?
===============================

`motionenv compare slow fast --paired --out compare.html` makes a page; this is the same in Python. Ten people walk
slowly and fast. They are compared with themselves, stride by stride of the gait cycle: the band holds the effect at all
phases at once, and people, not strides, are relabelled to find what chance alone does.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.cycles import register
from motionenv.gait import analyse, compare
from motionenv.gait.trial import ANGLES


def walks(speed: float) -> dict:
    """The analysed walk of each person."""
    made = (motionenv.synthesize("walk/fpca", seconds=4, fps=60, seed=k, speed=speed) for k in range(10))
    return {f"person {k}": [analyse(walk)] for k, walk in enumerate(made)}


slow, fast = walks(0.9), walks(1.4)
found = compare({"slow": slow, "fast": fast}, paired=True)
for name, p in found.p.items():
    where = ", ".join(f"{a} to {b} %" for a, b in found.effects[name].intervals)
    print(f"{name}: p = {p:.3f}, differs at {where or 'no phase'}")

percent = np.arange(101)
figure, axes = plt.subplots(2, 2, figsize=(8, 5), sharex=True, layout="constrained")
for (above, below), name in zip(axes.T, ("hip_flexion", "knee_flexion"), strict=True):
    for label, (mean, sd) in found.curves[name].items():
        above.plot(percent, mean, label=label)
        above.fill_between(percent, mean - sd, mean + sd, alpha=0.2, linewidth=0)
    effect = found.effects[name]
    below.fill_between(percent, effect.estimate - effect.band, effect.estimate + effect.band, color="0.85")
    below.plot(percent, effect.estimate, color="black")
    below.axhline(0, color="0.5", linewidth=0.8)
    above.set(title=name.replace("_", " "), ylabel="[°]")
    below.set(xlabel="gait cycle [%]", ylabel="fast - slow [°]")
axes[0, 0].legend()

# %%
# How much of that is timing? Fast walkers lift the foot earlier in the cycle. Registered by toe-off, all curves have it
# at the same phase: what is left is how shapes differ.

trials = [trial for group in (slow, fast) for (trial,) in group.values()]
KNEE = ANGLES.index("knee_flexion")
knees = np.array([trial.curves("left")[:, :-1, KNEE].mean(axis=0) for trial in trials])[..., None]
strides = [[s for s in trial.steady if s.side == "left"] for trial in trials]
toe_off = np.array([np.mean([(s.toe_off - s.start) / s.seconds for s in own]) for own in strides])
events = np.column_stack([np.zeros(len(trials)), toe_off])  # initial contact, toe-off
registered = register(knees, events)
print(f"toe-off at {100 * toe_off[:10].mean():.0f} % of slow cycles, {100 * toe_off[10:].mean():.0f} % of fast ones")

figure, axes = plt.subplots(1, 3, figsize=(10, 3), layout="constrained")
for axis, curves, title in (
    (axes[0], knees[..., 0], "as they are"),
    (axes[1], registered.values[..., 0], "registered"),
    (axes[2], 100 * registered.timing, "timing"),
):
    for k, curve in enumerate(curves):
        axis.plot(percent[:-1], curve, color="C0" if k < 10 else "C1", linewidth=0.8)
    axis.set(xlabel="gait cycle [%]", title=title)
axes[0].set_ylabel("knee flexion [°]")
axes[2].set_ylabel("later than common phase [%]")
