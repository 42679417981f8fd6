"""Walkers that the tests of views share."""

import numpy as np

from motionenv.types import MARKERS

HIDDEN = [MARKERS.index(m) for m in ("left_wrist", "right_knee", "head")]


def drawn(model, n: int, seed=0, rest: float = 0.01) -> np.ndarray:
    """Walkers (n, 5, 15, 3) of the model, and what its components leave out."""
    rng = np.random.default_rng(seed)
    scores = np.sqrt(model.explained_variance_) * rng.standard_normal((n, len(model.components_)))
    return model.inverse_transform(scores) + rest * rng.standard_normal((n, 5, 15, 3))
