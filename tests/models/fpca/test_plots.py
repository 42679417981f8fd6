"""The picture of components, read back from matplotlib."""

import numpy as np
import pytest

from motionenv import FunctionalPCA, MotionError
from motionenv.models.fpca import plots
from tests.models.fpca.made_cycles import as_cycles, low_rank


@pytest.fixture(scope="module")
def fitted():
    values, _ = low_rank(k=48)
    cycles = as_cycles(values, tuple(f"p{k // 4}" for k in range(48)))
    return FunctionalPCA("likelihood", n_harmonics=6).fit(cycles)


def test_modes_are_the_cycles_of_people_two_deviations_off(fitted):
    fpca = fitted
    figure = plots.components(fpca, ["angle_2", "angle_0"], n=2)
    for j, row in enumerate(np.array(figure.axes).reshape(2, 2)):
        off = 2 * np.sqrt(fpca.explained_variance_[j]) * np.eye(fpca.n_components_)[j]
        for panel, channel in zip(row, (2, 0), strict=True):
            for line, scores in zip(panel.lines, (0 * off, off, -off), strict=True):
                np.testing.assert_allclose(line.get_ydata(), fpca.inverse_transform(scores)[:, channel], atol=1e-9)
    with pytest.raises(MotionError, match="channels must be some of angle_0, .*; got knee"):
        plots.components(fpca, ["knee"])
