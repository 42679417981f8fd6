"""Prediction of the next pose from a drawn window, as in the paper or by analog forecasting.

Paper C takes the pose after the window, with a little Gaussian noise (section 4.2). But neighbours in a database differ
from the current motion by far more than a body moves in one frame. Analog forecasting therefore adds the difference
(Lguensat et al. 2017, "The analog data assimilation", eq. 5 and 6). Here it adds a share of the difference, fitted for
each parameter by least squares over pairs of neighbours from different sequences:

    next = ψ(i + 1) + a (φ(t) - ψ(i)) + b (φ̇(t) - ψ̇(i)) / fps + η,    η ~ N(0, diag(deviation²))

Poses are the first 25 parameters of `motionenv.models.motion_tree.features`, with increments of position and heading.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.representation import OneLine
from motionenv.models.motion_tree.database import Database
from motionenv.models.motion_tree.feature_kernels import parameters_at
from motionenv.models.motion_tree.features import FPS, local, turned_towards
from motionenv.models.motion_tree.search.exact import BLOCK, ExactSampler

_TEMPERATURE = 0.05  # at which neighbours are drawn
_PROBES, _KNOWN, _DRAWS = 2000, 200_000, 8  # query windows, windows searched, neighbours of each query


@dataclass(frozen=True, eq=False, repr=False)
class Forecast(OneLine):
    """Shares of the difference to add to predictions, and the predictions' root mean square errors [m, rad]."""

    pose: np.ndarray  # (25,) the share a
    velocity: np.ndarray  # (25,) the share b
    deviation: np.ndarray  # (25,) of one neighbour's prediction with these shares
    plain_deviation: np.ndarray  # (25,) the same with a = b = 0, as in the paper

    def carried(self, history: np.ndarray, now: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Predicted next poses (..., 25) as local parameters.

        `history` and `now` are the parameters (..., 50) of the last frames of the current motion and of the windows,
        `after` (..., 25) those of the frames behind the windows.
        """
        difference = _difference(history, now)
        return after + self.pose * difference[..., :25] + self.velocity * difference[..., 25:] / FPS


def steps(database: Database, frames: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Parameters (..., 50) of frames (...) that aren't the last of a sequence, and the first 25 of the next frames."""
    flat = np.ascontiguousarray(frames, dtype=np.int64).reshape(-1)
    now = np.empty((len(flat), 50))
    parameters_at(database.poses, database.starts[:-1], flat, FPS, now)
    return now.reshape(*np.shape(frames), 50), following(database, frames)


def following(database: Database, frames: ArrayLike) -> np.ndarray:
    """The first 25 parameters (..., 25) of the frames after `frames` (...), none of which is the last of a sequence."""
    frames = np.asarray(frames)
    return local(database.poses[frames], database.poses[frames + 1])


def fit_forecast(database: Database, coefficients: np.ndarray) -> Forecast:
    """Fit a forecast to a database, with queries from one half of the sequences and neighbours from the other.

    A single sequence is halved in time. The result is deterministic: queries are evenly spaced, and the neighbours are
    drawn with a fixed seed. `coefficients` (n, b) float32 are the windows' standardised c / σ, in the database's order.
    """
    frames = database.windows
    sequence = database.sequence_of(frames)
    half = sequence % 2 == 0 if len(database.clips) > 1 else np.arange(len(frames)) < len(frames) / 2
    known, asked = np.flatnonzero(half)[:_KNOWN], np.flatnonzero(~half)
    asked = asked[np.linspace(0, len(asked) - 1, min(_PROBES, len(asked))).astype(int)] if len(asked) else known
    rows = np.zeros((-(-len(known) // BLOCK) * BLOCK, coefficients.shape[1]), dtype=np.float32)
    rows[: len(known)] = coefficients[known]
    drawn, _ = ExactSampler.build(rows, len(known)).draw(coefficients[asked], _DRAWS, _TEMPERATURE, key=0)
    here, truth = steps(database, frames[asked])
    now, after = steps(database, frames[known][drawn])
    difference = _difference(here[:, None], now)
    error = turned_towards(truth[:, None] - after, difference[..., :25])
    x = np.stack([difference[..., :25], difference[..., 25:] / FPS], axis=-1)
    a, b = _least_squares(x, error)
    rest = error - a * x[..., 0] - b * x[..., 1]
    return Forecast(a, b, *(np.sqrt((e**2).mean((0, 1))) for e in (rest, error)))


def _difference(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Difference a - b of parameters (..., 25 or 50), with angles the shorter way round."""
    difference = a - b
    difference[..., :25] = turned_towards(difference[..., :25], np.zeros(25))
    return difference


def _least_squares(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Least-squares weights (2, 25) of y (..., 25) on x (..., 25, 2), for each parameter separately."""
    normal = np.einsum("pdck,pdcl->ckl", x, x)
    normal += 1e-9 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(2) + 1e-12 * np.eye(2)
    return np.linalg.solve(normal, np.einsum("pdck,pdc->ck", x, y)[..., None])[..., 0].T
