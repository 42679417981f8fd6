"""Log densities by which next poses are scored."""

import numpy as np
import pytest
from scipy.stats import norm

from benchmarks.tree.prediction import log_density
from motionenv.models.motion_tree.features import local
from motionenv.models.registry import load
from motionenv.models.synthesis import synthesize


def test_log_density_is_that_of_the_drawn_gaussians():
    tree, walk = load("mixed/tree"), synthesize("walk/fpca", 2, 30, seed=1)
    history, after = walk.poses[:40], walk.poses[40]
    got = log_density(tree, history, after, draws=64, seed=8)
    drawn = tree.sample(history, 64, seed=8, carry=True).poses
    error = local(history[-1], after) - local(history[-1], drawn)
    each = norm.logpdf(error, scale=tree.forecast_.deviation).sum(1)
    assert got == pytest.approx(np.log(np.exp(each - each.max()).mean()) + each.max())
