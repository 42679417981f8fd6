"""What in cycles doesn't suit a model of them: what is wrong, where, and the mend."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from motionenv._core.representation import counted
from motionenv._core.threads import in_chunks
from motionenv.cycles.spikes import NORMAL, spikes

if TYPE_CHECKING:
    from motionenv.models.fpca.model import FunctionalPCA

_TURN = 2 * np.pi
TURNS = 2  # by which an angle may be wrapped; what is further off is a spike
STRETCH = 0.05  # least share of the phases that is told when it is hardly seen
ENOUGH = 200  # cycles that tell by how much cycles differ
NARROW = 0.1 * _TURN  # deviation of cycles among which one that is off by a turn stands out
FEW = 0.02  # share of cycles below which a phase is hardly seen
FREEDOM = 4.0  # of the t distribution of `pseudo_values`
ROUNDS = 20
STEADY = 1e-3  # change of pseudo-values, in deviations, at which rounds end


class Summary(NamedTuple):
    """What cycles (K, P, m) are like without their gaps."""

    seen: np.ndarray  # (P, m) numbers of cycles that show a phase
    low: np.ndarray  # (m,)
    high: np.ndarray  # (m,)
    means: np.ndarray  # (K, m) of each cycle
    steps: np.ndarray  # (K, m) the largest between neighbours


def summarised(values: np.ndarray) -> Summary:
    """The summary of cycles (K, P, m)."""
    from motionenv.models.fpca._gap_kernels import summarise

    k, p, m = values.shape
    means, steps = np.zeros((2, k, m))

    def some(start: int, stop: int) -> tuple:
        seen, ends = np.zeros((p, m), dtype=np.int64), np.array([[np.inf], [-np.inf]]).repeat(m, axis=1)
        summarise(values[start:stop], seen, ends, means[start:stop], steps[start:stop])
        return seen, *ends

    seen, low, high = map(np.stack, zip(*in_chunks(some, k), strict=True))
    return Summary(seen.sum(axis=0), low.min(axis=0), high.max(axis=0), means, steps)


def screen(model: FunctionalPCA, values: np.ndarray, found: Summary, people: Sequence[str]) -> Iterator[str]:
    """What doesn't suit a fitted `model` in its cycles `values` (K, P, m), which are as `found`, in words."""
    wrapped = [] if model.unwrap else list(_wrapped(values, found, model.channels_))
    yield from wrapped
    if not (model.robust or wrapped):  # a jump by a turn is a spike, too
        yield from _spikes(values, found.steps, model.channels_)
    yield from _hardly_seen(found.seen / len(values), model.channels_)
    if still := [c for c, same in zip(model.channels_, found.low == found.high, strict=True) if same]:
        yield f"{', '.join(still)} never changes: leave it out with channels="
    if model.centre == "subject":
        labels, counts = np.unique(people, return_counts=True)
        if (counts == 1).any():
            once = ", ".join(labels[counts == 1][:5])
            yield f"{once}: a single cycle, which is its own mean and tells nothing of variation within people"


def _spikes(values: np.ndarray, steps: np.ndarray, channels: Sequence[str]) -> Iterator[str]:
    """Samples that stand out from those around them by more than cycles differ, and than others stand out."""
    for a, name in enumerate(channels):
        typical = _typical(values[:: max(1, len(values) // ENOUGH), :, a])
        rows = np.flatnonzero(steps[:, a] > typical)
        off = spikes(values[rows, :, a], typical) if len(rows) else np.zeros((1, 1))
        if off.any():
            k, p = np.unravel_index(off.argmax(), off.shape)
            yield (
                f"{name}: {counted(int(np.count_nonzero(off)), 'spike')}, the largest by {off.max():.3g} at phase "
                f"{p / off.shape[1]:.2f} of cycle {rows[k]}: set it to NaN, or pass robust=True"
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


def _wrapped(values: np.ndarray, found: Summary, channels: Sequence[str]) -> Iterator[str]:
    largest = np.maximum(found.steps.max(axis=0), np.ptp(found.means, axis=0))
    for a in np.flatnonzero(largest > np.pi).tolist():
        name, x = channels[a], values[..., a]
        if _typical(unwrapped(x[:: max(1, len(x) // ENOUGH), :, None])[..., 0]) >= NARROW:
            continue
        mended = unwrapped(x[..., None])[..., 0]
        moved, turns = np.isfinite(x) & (np.abs(mended - x) > 1.0), np.nanmax(np.abs(mended - x)) / _TURN
        # Only if the turns bring all cycles together: large numbers in another unit jump by more than a turn, too.
        off = np.abs(mended - median_cycle(mended))[moved].max(initial=0.0) / _TURN
        if moved.any() and turns < TURNS + 0.5 and off < 0.25:
            k, p = np.unravel_index(moved.argmax(), moved.shape)
            yield (
                f"{name}: jumps by a whole turn in {counted(int(moved.any(axis=1).sum()), 'cycle')}, first at phase "
                f"{p / x.shape[1]:.2f} of cycle {k}: pass unwrap=True"
            )


def _hardly_seen(share: np.ndarray, channels: Sequence[str]) -> Iterator[str]:
    for name, seen in zip(channels, share.T, strict=True):
        rare = seen <= min(FEW, 0.5 * float(seen.max()))
        if rare.sum() >= max(1.0, STRETCH * len(seen)):
            yield (
                f"{name}: {int(rare.sum())} of {len(seen)} phases, from {np.flatnonzero(rare)[0] / len(seen):.2f} on, "
                f"are hardly seen, {int((seen == 0).sum())} of them never, so its mean there is uncertain: leave it "
                "out with channels=, or add cycles that show it"
            )


def unwrapped(values: np.ndarray) -> np.ndarray:
    """Cycles `values` (K, P, m) [rad] without jumps by 2π, each at the turn nearest to the channel's median."""
    seen = np.isfinite(values)
    last = np.maximum.accumulate(np.where(seen, np.arange(values.shape[1])[:, None], 0), axis=1)
    out = np.where(seen, np.unwrap(np.nan_to_num(np.take_along_axis(values, last, axis=1)), axis=1), np.nan)
    counts = seen.sum(axis=1)
    means = np.sum(out, axis=1, where=seen) / np.maximum(counts, 1)
    for a in np.flatnonzero(counts.any(axis=0)):
        out[..., a] -= _TURN * np.round((means[:, a] - np.median(means[counts[:, a] > 0, a])) / _TURN)[:, None]
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
