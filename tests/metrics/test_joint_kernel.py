"""The compiled mean distance against NumPy's."""

import numpy as np

from motionenv.metrics import mpjpe
from motionenv.metrics.joint_kernel import mean_distances


def test_distances_are_those_of_mpjpe_and_an_unknown_joint_makes_them_unknown():
    rng = np.random.default_rng(0)
    estimates, truth = rng.normal(size=(2, 5, 15, 3))
    truth[3, 7, 1] = np.nan
    out = np.empty(5)
    factor, centre = np.array([2.0, 3.0, 0.5]), np.array([0.0, 1.0, -2.0])
    mean_distances((estimates - centre) / factor, truth, out, factor, centre)
    known = [0, 1, 2, 4]
    np.testing.assert_allclose(out[known], np.linalg.norm(estimates - truth, axis=-1).mean(-1)[known], rtol=1e-13)
    np.testing.assert_allclose(out[known], mpjpe(estimates, truth)[known], rtol=1e-13)
    assert np.isnan(out[3])
