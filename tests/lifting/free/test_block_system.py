"""The system over frames against dense linear algebra."""

import numpy as np
import pytest

from motionenv.errors import MotionError
from motionenv.lifting.free.block_system import solve

FEW = slice(1, 3)


def system(frames: int, n: int, rng: np.random.Generator):
    """Blocks of a positive definite matrix in which few unknowns couple frames two apart, the matrix, a right side."""
    rows = rng.standard_normal((3 * frames * n, frames * n))
    frame, unknown = np.divmod(np.arange(frames * n), n)
    distance, few = abs(frame[:, None] - frame), (FEW.start <= unknown) & (unknown < FEW.stop)
    coupled = (distance <= 1) | ((distance == 2) & few & few[:, None])
    dense = (rows.T @ rows) * coupled + 60 * np.eye(frames * n)
    blocks = dense.reshape(frames, n, frames, n)
    apart = lambda k: np.array([blocks[t, :, t + k] for t in range(frames - k)]).reshape(-1, n, n)
    return (apart(0), apart(1), apart(2)[:, FEW, FEW], FEW), dense, rng.standard_normal((frames, n))


@pytest.mark.parametrize("frames", [1, 2, 3, 6, 7])
def test_solution_and_covariances_are_those_of_dense_algebra(frames):
    blocks, dense, right = system(frames, 4, np.random.default_rng(frames))
    own, next_, *others = blocks
    solution, covariance = solve(own.copy(), next_.copy(), *others, right, True)
    np.testing.assert_allclose(solution.ravel(), np.linalg.solve(dense, right.ravel()), rtol=1e-10)
    inverse = np.linalg.inv(dense).reshape(frames, 4, frames, 4)
    np.testing.assert_allclose(covariance, [inverse[t, :, t] for t in range(frames)], rtol=1e-9)
    assert solve(*blocks, right)[1] is None


def test_what_frames_do_not_determine_is_told():
    (own, *others), _, right = system(4, 2, np.random.default_rng(0))
    own[1] = -np.eye(2)
    with pytest.raises(MotionError, match="don't determine"):
        solve(own, *others, right)
