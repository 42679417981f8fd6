"""
How are gaps filled?
====================

`motionenv.FunctionalPCA` learns how the joint angles of whole cycles vary together. Given what was seen of a cycle, it
fills the rest with what is most probable. Here half a cycle of one person's left knee is hidden on purpose, so the
filled samples can be compared with the truth.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import motionenv

people = [motionenv.synthesize("walk/fpca", seconds=5, fps=60, seed=seed) for seed in range(25)]
cycles = motionenv.segment([p.angles for p in people], fps=60, subjects=[str(i) for i in range(25)])
knee = cycles.channels.index("left_knee_flexion")
last = np.array(cycles.subject) == "24"
hidden = slice(40, 104)  # of the 128 samples of a cycle
values = cycles.values.copy()
values[last, hidden, knee] = np.nan

fpca = motionenv.FunctionalPCA(n_components=5).fit(replace(cycles, values=values))
truth = np.degrees(cycles.values[last][0, :, knee])
filled = np.degrees(fpca.impute(values[last])[0, :, knee])
mean = np.degrees(np.nanmean(values[~last], axis=0)[:, knee])
for name, curve in (("filled", filled), ("mean of the others", mean)):
    print(f"{name}: {np.sqrt(np.mean((curve - truth)[hidden] ** 2)):.1f}° off where hidden (rms)")

# %%
# The other angles of the cycle, and the half of the knee's that was seen, say in what way this person differs from the
# others. To fill the gaps of whole recordings, use `motionenv.fill`.

percent = np.arange(128) / 128 * 100
figure, axis = plt.subplots(figsize=(7, 3.6), layout="constrained")
axis.axvspan(percent[hidden.start], percent[hidden.stop], color="0.93")
axis.text(percent[72], 72, "hidden", ha="center", color="0.4")
axis.plot(percent, mean, color="0.7", label="mean of the others")
axis.plot(percent, truth, color="black", linestyle="--", label="truth")
axis.plot(percent[hidden], filled[hidden], color="#d55e00", linewidth=2, label="filled")
axis.set(xlabel="cycle [%]", ylabel="left knee flexion [°]", xlim=(0, 100), ylim=(-2, 79))
axis.legend(loc="upper left", fontsize="small")
