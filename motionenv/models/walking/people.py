"""What a walking model learns of people: how they and their cycles differ, and what speed does to them."""

from typing import TYPE_CHECKING

import numpy as np

from motionenv.models.people.pace import Pace, fit_pace
from motionenv.models.walking.tables import root_of
from motionenv.types import Cycles

if TYPE_CHECKING:
    from motionenv.models.walking.model import WalkingModel

_WHOLE = 0.8  # least share of the samples that its walk could show, for a cycle to tell how cycles vary
_UNEVEN = 3.0  # times the median trial's variance between cycles
_DRAWN = 300  # walks that tell how long strides are


def fit_people(model: "WalkingModel", cycles: Cycles, speeds: np.ndarray) -> None:
    """Fit the Gaussians of trials and of their cycles, and `pace_`, of a `model` that has components and a body.

    `cycles` are those that it was fitted to, `speeds` (trials,) [body heights / s].
    """
    scores, seen = model.fpca_.scores_, np.isfinite(cycles.values).mean((1, 2))
    rows, people, within = [], [], []
    for trial in np.unique(cycles.sequence):
        mine = cycles.sequence == trial
        weight = seen[mine] / seen[mine].sum()
        mean = weight @ scores[mine]
        whole = seen[mine] / np.isfinite(cycles.values[mine]).any((0, 1)).mean() > _WHOLE
        rows.append([*mean, np.log(cycles.seconds[mine][0]), np.log(speeds[trial])])
        people.append(cycles.subject[np.flatnonzero(mine)[0]])
        within.append((scores[mine] - mean)[whole])
    taken = np.array(rows)
    _, which, count = np.unique(people, return_inverse=True, return_counts=True)
    weight = 1.0 / count[which]
    model.person_mean_ = np.average(taken, axis=0, weights=weight)
    one = len(rows) == 1  # a single walk has no covariance
    model.person_covariance_ = np.zeros(2 * taken.shape[1:]) if one else np.cov(taken.T, aweights=weight)
    model.cycle_covariance_ = _even(within)
    model.pace_ = _pace(model, taken, people)


def _even(trials: list[np.ndarray]) -> np.ndarray:
    """Covariance (q, q) of the scores (cycles, q) of trials' cycles about their mean, in trials of even walking.

    In a few captures somebody starts, stops or turns; their cycles vary many times as much as others'.
    """
    free = np.array([max(len(trial) - 1, 0) for trial in trials])
    square = np.array([(trial**2).sum() for trial in trials]) / np.maximum(free, 1)
    kept = square <= _UNEVEN * np.median(square)
    spread = np.concatenate([trial for trial, is_kept in zip(trials, kept, strict=True) if is_kept])
    return spread.T @ spread / max(free[kept].sum(), 1)


def _pace(model: "WalkingModel", rows: np.ndarray, people: list[str]) -> Pace:
    """What speed does, from trials' (scores, log stride time, log speed) and the strides of synthetic walks."""
    fpca, q = model.fpca_, model.fpca_.n_components
    spread = 1.5 * root_of(model.person_covariance_[:q, :q])  # a little wider than people
    scores = model.person_mean_[:q] + np.random.default_rng(0).standard_normal((_DRAWN, q)) @ spread
    speeds = model.crowd(scores)[1]
    lengths = np.log(speeds * model.stride_seconds(scores) / model.height_)
    knees = [fpca.channels_.index(f"{side}_knee_flexion") for side in ("left", "right")]
    bend = np.mean([fpca.components_[:, fpca.mean_[:, i].argmax(), i] for i in knees], axis=0)
    own = model.standard(rows[:, :q]), people, rows[:, q + 1], rows[:, q] + rows[:, q + 1]
    return fit_pace(*own, model.standard(scores), lengths, bend * model.components().deviations)
