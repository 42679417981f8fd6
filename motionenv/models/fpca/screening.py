"""What in cycles doesn't suit a model of them: what is wrong, where, and the mend."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from motionenv._core.representation import counted
from motionenv.cycles.spikes import NORMAL, spikes

if TYPE_CHECKING:
    from motionenv.models.fpca.model import FunctionalPCA

_TURN = 2 * np.pi
TURNS = 2  # by which an angle may be wrapped; what is further off is a spike
STRETCH = 0.05  # least share of the phases that is told when it is hardly seen
NARROW = 0.1 * _TURN  # deviation of cycles among which one that is off by a turn stands out
FEW = 0.02  # share of cycles below which a phase is hardly seen
FREEDOM = 4.0  # of the t distribution of `pseudo_values`
ROUNDS = 20
STEADY = 1e-3  # change of pseudo-values, in deviations, at which rounds end


def screen(model: FunctionalPCA, values: np.ndarray, people: Sequence[str]) -> Iterator[str]:
    """What doesn't suit a fitted `model` in its cycles `values` (K, P, m), in words."""
    wrapped = [] if model.unwrap else list(_wrapped(values, model.channels_))
    yield from wrapped
    if not (model.robust or wrapped):  # a jump by a turn is a spike, too
        yield from _spikes(values, model.channels_)
    yield from _hardly_seen(values, model.channels_)
    still = [c for c, x in zip(model.channels_, np.moveaxis(values, 2, 0), strict=True) if np.nanmin(x) == np.nanmax(x)]
    if still:
        yield f"{', '.join(still)} never changes: leave it out with channels="
    if model.centre == "subject":
        labels, counts = np.unique(people, return_counts=True)
        if (counts == 1).any():
            once = ", ".join(labels[counts == 1][:5])
            yield f"{once}: a single cycle, which is its own mean and tells nothing of variation within people"


def _spikes(values: np.ndarray, channels: Sequence[str]) -> Iterator[str]:
    """Samples that stand out from the four around them by more than cycles differ, and than others stand out."""
    for name, x in zip(channels, np.moveaxis(values, 2, 0), strict=True):
        typical = _typical(x)
        if not (np.abs(np.diff(x, axis=1)) > typical).any():
            continue
        off = spikes(x, typical)
        if off.any():
            k, p = np.unravel_index(off.argmax(), off.shape)
            yield (
                f"{name}: {counted(int(np.count_nonzero(off)), 'spike')}, the largest by {off.max():.3g} at phase "
                f"{p / x.shape[1]:.2f} of cycle {k}: set it to NaN, or pass robust=True"
            )


def _typical(x: np.ndarray) -> float:
    """By how much samples of cycles (K, P) differ: their robust deviation, or a tenth of the range within a cycle."""
    median = median_cycle(x)
    off = np.abs(x - median)
    return max(NORMAL * float(np.median(off[np.isfinite(off)])), 0.1 * float(np.nanmax(median) - np.nanmin(median)))


def median_cycle(x: np.ndarray) -> np.ndarray:
    """Median (P,) of cycles (K, P) at each phase; NaN where none is seen."""
    found = np.full(x.shape[1], np.nan)
    seen = np.isfinite(x).any(axis=0)
    found[seen] = np.nanmedian(x[:, seen], axis=0)
    return found


def _wrapped(values: np.ndarray, channels: Sequence[str]) -> Iterator[str]:
    for name, x in zip(channels, np.moveaxis(values, 2, 0), strict=True):
        if not np.nanmax(x) - np.nanmin(x) > np.pi:
            continue
        mended = unwrapped(x[..., None])[..., 0]
        moved = np.isfinite(x) & (np.abs(mended - x) > 1.0)
        # Only if the turns bring the cycles together: large numbers in another unit jump by more than a turn too.
        turns = np.nanmax(np.abs(mended - x)) / _TURN
        if moved.any() and turns < TURNS + 0.5 and _typical(mended) < NARROW and _closer(mended, moved):
            k, p = np.unravel_index(moved.argmax(), moved.shape)
            yield (
                f"{name}: jumps by a whole turn in {counted(int(moved.any(axis=1).sum()), 'cycle')}, first at phase "
                f"{p / x.shape[1]:.2f} of cycle {k}: pass unwrap=True"
            )


def _closer(mended: np.ndarray, moved: np.ndarray) -> bool:
    """Whether all samples of cycles (K, P) that were `moved` are now within a quarter turn of the median cycle."""
    return bool(np.abs(mended - median_cycle(mended))[moved].max() < 0.25 * _TURN)


def _hardly_seen(values: np.ndarray, channels: Sequence[str]) -> Iterator[str]:
    share = np.isfinite(values).mean(axis=0)
    for name, seen in zip(channels, share.T, strict=True):
        rare = seen <= min(FEW, 0.5 * float(seen.max()))
        if rare.sum() >= max(1.0, STRETCH * len(seen)):
            yield (
                f"{name}: {int(rare.sum())} of {len(seen)} phases, from {np.flatnonzero(rare)[0] / len(seen):.2f} on, "
                f"are hardly seen, {int((seen == 0).sum())} of them never, so its mean there is uncertain: leave it out "
                "with channels=, or add cycles that show it"
            )


def unwrapped(values: np.ndarray) -> np.ndarray:
    """Cycles `values` (K, P, m) [rad] without jumps by 2π, each at the turn nearest to the channel's median."""
    out = values.copy()
    for x in np.moveaxis(out, 2, 0):
        for cycle in x:
            seen = np.isfinite(cycle)
            if seen.any():
                cycle[seen] = np.unwrap(cycle[seen])
        if np.isfinite(x).any():
            each = np.array([np.median(cycle[np.isfinite(cycle)]) if np.isfinite(cycle).any() else 0.0 for cycle in x])
            x -= _TURN * np.round((each - np.median(each)) / _TURN)[:, None]
    return out


def pseudo_values(values: np.ndarray, fitted: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Cycles (K, P, m) with samples drawn towards the model, the more the further they are from it.

    The likelihood of t-distributed residuals with 4 degrees of freedom weighs each by 5 / (4 + r² / s²) (Lange, Little
    & Taylor 1989). A least-squares fit to pseudo-values, the model plus the weighted residual, is one step of that
    fit (Huber 1981, section 7.8). Residuals that are as large as usual get weight 1. The first model is the median
    cycle.

    Args:
        values: (K, P, m), NaN where missing.
        fitted: cycles of a model fitted to some values, which are passed to it.
    """
    model: np.ndarray = np.stack([median_cycle(x) for x in np.moveaxis(values, 2, 0)], axis=1)
    used = values
    for _ in range(ROUNDS):
        rest = values - model
        scale = np.maximum(NORMAL * np.nanmedian(np.abs(rest), axis=(0, 1)), 1e-300)
        weights = np.minimum((FREEDOM + 1) / (FREEDOM + (rest / scale) ** 2), 1.0)
        before, used = used, model + weights * rest
        if np.nanmax(np.abs(used - before) / scale) < STEADY:
            break
        model = fitted(used)
    return used
