"""Effect of speed on Fourier walkers: a direction of their coefficients, as in `motionenv.models.people.pace`."""

from typing import TYPE_CHECKING

import numpy as np

from motionenv.models.eigenwalkers.fourier_series import body_heights, centred, in_phase, mirrored, stride_lengths
from motionenv.models.eigenwalkers.table import Table
from motionenv.models.people.pace import EXPONENT, exponent, reached, shrunk, within

if TYPE_CHECKING:
    from motionenv.models.eigenwalkers.fourier_model import FourierModel


def at_speed(
    model: "FourierModel", w: np.ndarray, seconds: float | np.ndarray, speed: float | np.ndarray
) -> np.ndarray:
    """The people `w` (..., 5, 15, 3) [m] of a fitted `model` at another `speed` (...) [m/s].

    `seconds` (...) [s] are their stride times at their own speed.
    """
    return longer(model, w, model.speed_exponent_ * np.log(speed * seconds / stride_lengths(w)))


def longer(model: "FourierModel", w: np.ndarray, change: float | np.ndarray) -> np.ndarray:
    """The people `w` (..., 5, 15, 3) [m] with log stride lengths that differ by `change` (...), by a fitted `model`."""
    size = body_heights(w.reshape(-1, *w.shape[-3:])).reshape(w.shape[:-3])
    length, average = stride_lengths(w), model.mean_[None]
    middle = float(np.log(stride_lengths(average) / body_heights(average))[0])
    now = np.log(length / size)
    wanted = reached(now + change, middle) - reached(now, middle)
    way = size[..., None, None, None] * model.speed_direction_
    step = wanted
    for _ in range(2):  # strides lengthen almost in proportion
        step = step + wanted - np.log(stride_lengths(w + step[..., None, None, None] * way) / length)
    return w + step[..., None, None, None] * way


def learn_speed(model: "FourierModel", walks: Table, people: Table) -> None:
    """Fit what speed does; left and right learn from each other.

    Args:
        model: gets `speed_direction_`, `speed_exponent_` and `learned_speeds_`.
        walks: captured walks.
        people: means of people's walks, to learn from if the walks show one leg each.
    """
    heights, strides = _sizes(walks)
    if np.isfinite(strides).sum() < 2:
        walks = Table(people.rows, people.frequencies, tuple(map(str, range(len(people)))))
        heights, strides = _sizes(walks)
    known, pace = np.isfinite(heights * strides), walks.frequencies
    if known.sum() < 2:  # no two walks or people show both legs
        model.speed_direction_, model.speed_exponent_ = np.zeros(model.mean_.shape), EXPONENT
        model.learned_speeds_ = stride_lengths(model.mean_) * np.array([pace.min(), pace.max()])
        return
    who = np.array(walks.people)[known]
    log_lengths, speeds = np.log((strides / heights)[known]), (strides * pace)[known]
    x = log_lengths - log_lengths.mean()
    weights = np.zeros((len(walks), 2))
    weights[known] = np.column_stack([within(log_lengths, who), x])
    inside, between = _slopes(walks, known, heights, weights)
    found = shrunk(inside, log_lengths, who, between / max(float(x @ x), 1e-9)).reshape(model.mean_.shape)
    model.speed_direction_ = 0.5 * (found + mirrored(found))
    model.speed_exponent_ = exponent(log_lengths, np.log(speeds / heights[known]), who)
    model.learned_speeds_ = np.array([speeds.min(), speeds.max()])


def _sizes(walks: Table) -> tuple[np.ndarray, np.ndarray]:
    w = _comparable(walks.rows)
    return body_heights(w), stride_lengths(w)


def _comparable(w: np.ndarray) -> np.ndarray:
    return centred(in_phase(w))


def _slopes(walks: Table, known: np.ndarray, heights: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Weighted sums (2, 225) of the `known` walks' coefficients in body heights, less their means; unknown are 0."""
    values, weights = _comparable(walks.rows[known]).reshape(-1, 225) / heights[known, None], weights[known]
    there = np.isfinite(values)
    values = np.where(there, values, 0.0)
    return weights.T @ values - weights.T @ there * (values.sum(axis=0) / np.maximum(there.sum(axis=0), 1))
