"""
How different are the people that I draw?
=========================================

Without further arguments, `motionenv.synthesize` draws an adult: height, body proportions, comfortable speed and walk
ratio (step length over cadence) come from distributions published for adults, and the style of the walk from the gait
model. Here are a hundred people, each measured as a gait laboratory would.
"""

import matplotlib.pyplot as plt
import numpy as np

import motionenv
from motionenv.gait import Session, analyse


def measured(seed: int) -> dict[str, float]:
    """Height and step parameters of a person, over the steps of both sides."""
    walk = motionenv.synthesize("walk/fpca", seconds=5, fps=100, seed=seed)
    session = Session((analyse(walk),), left_out={})
    found = {p.name: p.mean for p in session.parameters if not p.side}
    return {"height": walk.skeleton.height, **found}


people = [measured(seed) for seed in range(100)]
units = {"height": "m", "speed": "m/s", "cadence": "steps/min", "step_length": "m"}
values = {name: np.array([person[name] for person in people]) for name in units}
for name, unit in units.items():
    print(f"{name:11} {values[name].mean():6.2f} ± {values[name].std():.2f} {unit}")
correlation = np.corrcoef(values["cadence"], values["step_length"])[0, 1]
print(f"correlation of cadence and step length: {correlation:.2f}")

# %%
# People who take quicker steps also take longer ones, roughly along the lines of equal walk ratio. Taller people have a
# higher walk ratio: at the same cadence they take longer steps.

figure, axis = plt.subplots(figsize=(6.5, 4.2), layout="constrained")
for ratio in (0.0045, 0.0055, 0.0065):
    end = min(142, 0.8 / ratio)
    axis.plot((92, end), (92 * ratio, end * ratio), color="0.8", zorder=0)
    axis.text(end, end * ratio, f" {ratio}", color="0.5", va="center")
dots = axis.scatter(values["cadence"], values["step_length"], c=values["height"], edgecolor="white")
figure.colorbar(dots, label="height [m]")
axis.set(xlabel="cadence [steps/min]", ylabel="step length [m]", xlim=(92, 149), ylim=(0.48, 0.82))
axis.set_title("grey lines: walk ratio [m/(steps/min)]", fontsize="medium")
