"""What speed does to Fourier walkers: a direction of their coefficients, as in `motionenv.models.people.pace`."""

from typing import TYPE_CHECKING

import numpy as np

from motionenv.models.eigenwalkers.fourier_series import (
    FourierWalker,
    body_heights,
    centred,
    in_phase,
    mirrored,
    stride_lengths,
)  # fmt: skip
from motionenv.models.people.pace import EXPONENT, direction, exponent, reached

if TYPE_CHECKING:
    from motionenv.models.eigenwalkers.fourier_model import FourierModel


def at_speed(model: "FourierModel", w: np.ndarray, seconds, speed) -> np.ndarray:
    """The people `w` (..., 5, 15, 3) [m] of a fitted `model` at another `speed` (...) [m/s].

    `seconds` (...) [s] are their stride times at their own speed.
    """
    return longer(model, w, model.speed_exponent_ * np.log(speed * seconds / stride_lengths(w)))


def longer(model: "FourierModel", w: np.ndarray, change) -> np.ndarray:
    """The people `w` (..., 5, 15, 3) [m] with log stride lengths that differ by `change` (...), by a fitted `model`."""
    size = body_heights(w.reshape(-1, *w.shape[-3:])).reshape(w.shape[:-3])
    length, average = stride_lengths(w), model.mean_[None]
    middle = float(np.log(stride_lengths(average) / body_heights(average))[0])
    now = np.log(length / size)
    change = reached(now + change, middle) - reached(now, middle)
    way = size[..., None, None, None] * model.speed_direction_
    step = change
    for _ in range(2):  # strides lengthen almost in proportion
        step = step + change - np.log(stride_lengths(w + step[..., None, None, None] * way) / length)
    return w + step[..., None, None, None] * way


def learn_speed(model: "FourierModel", walkers: list[FourierWalker], subjects, merged, log_frequencies) -> None:
    """Fit what speed does; left and right learn from each other.

    Args:
        model: gets `speed_direction_`, `speed_exponent_` and `learned_speeds_`.
        walkers: captured walks.
        subjects: the person's label of each.
        merged: (R, 5, 15, 3) [m] people's walks, to learn from if the walks show one leg each.
        log_frequencies: (R,) of these [Hz].
    """
    w = centred(in_phase(np.stack([walker.coefficients for walker in walkers])))
    pace, people = np.array([walker.frequency for walker in walkers]), np.array(subjects)
    if np.isfinite(stride_lengths(w)).sum() < 2:
        w, pace, people = merged, np.exp(log_frequencies), np.arange(len(merged))
    heights, strides = body_heights(w), stride_lengths(w)
    known = np.isfinite(heights * strides)
    if known.sum() < 2:  # no two walks or people show both legs
        model.speed_direction_, model.speed_exponent_ = np.zeros(model.mean_.shape), EXPONENT
        model.learned_speeds_ = stride_lengths(model.mean_) * np.array([pace.min(), pace.max()])
        return
    w, heights, strides, pace, people = (values[known] for values in (w, heights, strides, pace, people))
    values = (w / heights[:, None, None, None]).reshape(len(w), -1)
    seen = np.isfinite(values)
    values = np.where(seen, values - np.nansum(values, axis=0) / np.maximum(seen.sum(axis=0), 1), 0.0)
    log_lengths, speeds = np.log(strides / heights), strides * pace
    x = log_lengths - log_lengths.mean()
    found = direction(values, log_lengths, people, x @ values / max(float(x @ x), 1e-9)).reshape(model.mean_.shape)
    model.speed_direction_ = 0.5 * (found + mirrored(found))
    model.speed_exponent_ = exponent(log_lengths, np.log(speeds / heights), people)
    model.learned_speeds_ = np.array([speeds.min(), speeds.max()])
