"""
How are gaps filled?
====================

A model of whole cycles knows what usually belongs to what was seen. Filled samples come with the truth here, as half
of a knee's cycle was removed on purpose.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import motionenv

people = [motionenv.synthesize("walk/fpca", seconds=5, fps=60, seed=seed) for seed in range(25)]
cycles = motionenv.segment([p.angles for p in people], fps=60, subjects=[str(i) for i in range(25)])
knee = cycles.channels.index("left_knee_flexion")
last = np.array([person == "24" for person in cycles.subject])
values = cycles.values.copy()
values[last, 40:104, knee] = np.nan

fpca = motionenv.FunctionalPCA(n_components=5).fit(replace(cycles, values=values))
filled = fpca.impute(values[last])[0, :, knee]
truth, seen = cycles.values[last][0, :, knee], values[last][0, :, knee]
mean = fpca.evaluate(np.zeros(5), np.arange(128) / 128)[:, knee]
figure, axis = plt.subplots(figsize=(6, 3.4), layout="constrained")
for curve, style, name in (
    (truth, "k--", "truth"),
    (filled, "C1", "filled"),
    (seen, "C0", "seen"),
    (mean, "0.7", "mean"),
):
    axis.plot(np.linspace(0, 100, 128), np.degrees(curve), style, label=name)
axis.set(xlabel="cycle [%]", ylabel="left knee flexion [°]")
axis.legend()
