"""Pictures of a functional PCA, read back from matplotlib."""

import numpy as np
import pytest

from motionenv import FunctionalPCA, MotionError
from motionenv.models.fpca import plots
from tests.models.fpca.made_cycles import as_cycles, low_rank


@pytest.fixture(scope="module")
def fitted():
    values, _ = low_rank(k=48)
    cycles = as_cycles(values, tuple(f"p{k // 4}" for k in range(48)))
    return FunctionalPCA("likelihood", n_harmonics=6).fit(cycles), cycles


def test_modes_are_the_cycles_of_people_two_deviations_off(fitted):
    fpca, _ = fitted
    figure = plots.components(fpca, ["angle_2", "angle_0"], n=2)
    for j, row in enumerate(np.array(figure.axes).reshape(2, 2)):
        off = 2 * np.sqrt(fpca.explained_variance_[j]) * np.eye(fpca.n_components_)[j]
        for panel, channel in zip(row, (2, 0), strict=True):
            for line, scores in zip(panel.lines, (0 * off, off, -off), strict=True):
                np.testing.assert_allclose(line.get_ydata(), fpca.inverse_transform(scores)[:, channel], atol=1e-9)
    with pytest.raises(MotionError, match="channels must be some of angle_0, .*; got knee"):
        plots.components(fpca, ["knee"])


def test_scree_adds_up_and_shows_the_curve_that_chose(fitted):
    fpca, _ = fitted
    shares, held_out = plots.scree(fpca).axes
    heights = [bar.get_height() for bar in shares.patches]
    assert sum(heights) + 100 * fpca.noise_ratio_ == pytest.approx(100)
    assert held_out.lines[-1].get_xdata()[0] == fpca.n_components_ == 3
    restored = FunctionalPCA.from_arrays(*fpca.to_arrays())
    assert len(plots.scree(restored).axes) == 1  # a file doesn't keep the curve


def test_every_cycle_has_its_scores_and_every_person_a_colour(fitted):
    fpca, cycles = fitted
    figure = plots.scores(fpca, cycles, (1, 0))
    drawn = [line.get_xydata() for line in figure.axes[0].lines if len(line.get_xydata()) == 4]
    assert len(drawn) == 12
    where = np.concatenate(drawn)
    expected = fpca.transform(cycles)[:, [1, 0]]
    np.testing.assert_allclose(where[np.lexsort(where.T)], expected[np.lexsort(expected.T)])
    with pytest.raises(MotionError, match="pair must be two of the components 0 to 2"):
        plots.scores(fpca, cycles, (0, 3))


def test_residuals_are_one_where_the_model_holds_and_dark_where_not(fitted):
    fpca, cycles = fitted
    picture = plots.residuals(fpca, cycles).axes[0].images[0].get_array()
    assert picture.shape == (4, 64)
    assert np.sqrt(np.mean(picture**2)) == pytest.approx(1, abs=0.1)
    wrong = cycles.values.copy()
    wrong[:, 20:30, 1] += 0.5 * (-1) ** np.arange(48)[:, None]
    dark = plots.residuals(fpca, as_cycles(wrong)).axes[0].images[0].get_array()
    assert dark[1, 20:30].min() > 3 > 1.6 > np.delete(dark, np.s_[16:34], axis=1).max()
