"""
A, fig. 8: functional PCA with gaps
===================================

The paper's algorithm fills gaps by what the components say, fits them again, and goes on until nothing changes. It
shows no figure of how well that fills; here is ours, for more and more of every cycle hidden, in cycles of drawn
people.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import motionenv

people = [motionenv.synthesize("walk/fpca", seconds=5, fps=60, seed=seed) for seed in range(30)]
cycles = motionenv.segment([p.angles for p in people], fps=60, subjects=[str(i) for i in range(30)])


def rms(errors: np.ndarray) -> float:
    """Root mean square of what is known: cycles at the ends of a walk have gaps of their own."""
    return float(np.sqrt(np.nanmean(errors**2)))


shares = np.arange(0.05, 0.75, 0.1)
errors = {"ppca": [], "svd": [], "mean of the cycles": []}
for share in shares:
    rng = np.random.default_rng(1)
    start = rng.random((len(cycles.values), 1, 19))  # in each cycle and channel a block of the cycle is hidden
    hidden = np.mod(np.arange(128)[None, :, None] / 128 - start, 1) < share
    gappy = replace(cycles, values=np.where(hidden, np.nan, cycles.values))
    for method in ("ppca", "svd"):
        filled = motionenv.FunctionalPCA(n_components=5, method=method).fit(gappy).impute(gappy.values)
        errors[method].append(np.degrees(rms((filled - cycles.values)[hidden])))
    means = np.broadcast_to(np.nanmean(gappy.values, axis=0), hidden.shape)
    errors["mean of the cycles"].append(np.degrees(rms((means - cycles.values)[hidden])))
figure, axis = plt.subplots(figsize=(5.5, 3.6), layout="constrained")
for name, values in errors.items():
    axis.plot(100 * shares, values, "o-", label=name)
axis.set(xlabel="hidden [%]", ylabel="error of what was hidden [°], rms", ylim=(0, None))
axis.legend()
