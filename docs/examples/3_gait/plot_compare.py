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
from motionenv.gait import analyse, compare


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
