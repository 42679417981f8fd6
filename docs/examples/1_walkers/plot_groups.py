"""
How different are the people that I draw?
=========================================

A hundred people at their own pace: cadence and step length vary as people's do, and not independently.
"""

import matplotlib.pyplot as plt

import motionenv
from motionenv.gait import Session, analyse


def measured(seed: int) -> dict[str, float]:
    """Step parameters of a person, both sides together."""
    walk = motionenv.synthesize("walk/fpca", seconds=5, fps=100, seed=seed)
    return {p.name: p.mean for p in Session((analyse(walk),), left_out={}).parameters if not p.side}


people = [measured(seed) for seed in range(100)]
figure, axis = plt.subplots(figsize=(5.5, 4), layout="constrained")
dots = axis.scatter([p["cadence"] for p in people], [p["step_length"] for p in people], c=[p["speed"] for p in people])
figure.colorbar(dots, label="speed [m/s]")
axis.set(xlabel="cadence [steps/min]", ylabel="step length [m]")
