"""Cycles: speed against vectorised NumPy, and accuracy against gait events of captured walks.

motionenv bench cycles [--mocap FOLDER]
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from benchmarks import Arguments, captured_walks, shortest
from motionenv.cycles import align, estimate_period, periodic_basis, segment, snr
from motionenv.errors import MotionError


def snr_by_bincount(z, candidates):
    """The corrected SNR by two vectorised np.bincount per candidate, for sums and counts."""
    seen = ~np.isnan(z)
    z = np.where(seen, z - np.nanmean(z, axis=0), 0.0)
    total, n, m = (z**2).sum(axis=0), seen.sum(axis=0), z.shape[1]
    out = []
    for p in candidates:
        cell = ((np.arange(len(z)) % p)[:, None] * m + np.arange(m)).ravel()
        sums = np.bincount(cell, z.ravel(), p * m).reshape(p, m)
        counts = np.bincount(cell, seen.ravel(), p * m).reshape(p, m)
        between, bins = (sums**2 / np.maximum(counts, 1)).sum(axis=0), (counts > 0).sum(axis=0)
        out.append(between / (bins - 1) / ((total - between) / (n - bins)))
    return np.array(out)


def align_by_table(sequences, periods, rounds, lookup):
    """Fig. 6 for whole periods, all offsets of a sequence at once; stops after `rounds` updates.

    With `lookup`, the table of phases (p, T) indexes a reference tabulated at p phases. Otherwise the splines are
    evaluated at each phase, as fractional periods require.
    """
    offsets = np.zeros(len(sequences), dtype=int)
    stacked = np.concatenate(sequences)
    for _ in range(rounds):
        phases = [np.arange(len(z)) - o for z, o in zip(sequences, offsets, strict=True)]
        basis = periodic_basis(np.concatenate([t % p / p for t, p in zip(phases, periods, strict=True)]))
        seen = ~np.isnan(stacked)
        fits = [np.linalg.lstsq(basis[s], z[s], rcond=None)[0] for s, z in zip(seen.T, stacked.T, strict=True)]
        reference = np.stack(fits, axis=1)
        for i, (z, p) in enumerate(zip(sequences, periods, strict=True)):
            table = (np.arange(len(z)) - np.arange(p)[:, None]) % p
            if lookup:
                curve = (periodic_basis(np.arange(p) / p) @ reference)[table]
            else:
                curve = (periodic_basis(table.ravel() / p) @ reference).reshape(*table.shape, -1)
            offsets[i] = np.nansum((z - curve) ** 2, axis=(1, 2)).argmin()
    return offsets


def walkers(n, m=19, seed=0):
    """`n` noisy sequences of a common pattern, 15 % missing, and their integer periods."""
    rng = np.random.default_rng(seed)
    size, start, periods = rng.normal(size=(4, m)), rng.uniform(0, 6.3, (4, m)), rng.integers(100, 160, n)
    sequences = []
    for p in periods:
        turn = 2 * np.pi * (np.arange(rng.integers(350, 650))[:, None] - rng.integers(p)) / p
        own = start + 0.2 * rng.normal(size=(4, m))
        z = sum(size[k] * np.cos((k + 1) * turn + own[k]) / (k + 1) for k in range(4))
        z += 0.2 * rng.normal(size=z.shape)
        z[rng.random(z.shape) < 0.15] = np.nan
        sequences.append(z)
    return sequences, periods


def speed_of_snr(frames):
    """Print the speed of the SNR of `frames` × 19, 20 % missing, 221 candidates."""
    z, candidates = np.random.default_rng(0).normal(size=(frames, 19)), np.arange(60, 281)
    z[np.random.default_rng(1).random(z.shape) < 0.2] = np.nan
    np.testing.assert_allclose(snr(z, candidates).channels, snr_by_bincount(z, candidates), rtol=1e-9)
    ours, theirs = shortest(lambda: snr(z, candidates), 31), shortest(lambda: snr_by_bincount(z, candidates), 5)
    ratio = f"{theirs / ours:.0f}×"
    print(f"| SNR, {frames:,} × 19, 221 candidates | {1e3 * ours:.2f} ms | bincount {1e3 * theirs:.0f} ms | {ratio} |")


def speed_of_offsets(n, measured):
    """Print the speed of alignment; the peers run the first `measured` rounds, and their time is extrapolated."""
    sequences, periods = walkers(n)
    alignment = align(sequences, periods)
    rounds = len(alignment.errors) - 1
    ours = shortest(lambda: align(sequences, periods), 5)
    for name, lookup in (("phase table, looked up", True), ("phase table, evaluated", False)):
        k = min(measured if lookup else 1, rounds)
        theirs = shortest(lambda k=k, lookup=lookup: align_by_table(sequences, periods, k, lookup), 1) * rounds / k
        same = ""
        if k == rounds:
            found = align_by_table(sequences, periods, rounds, lookup)
            same = ", identical offsets" if (found == alignment.offsets).all() else ", OTHER OFFSETS"
        print(
            f"| offsets, {n} sequences, {rounds} rounds | {1e3 * ours:.0f} ms | {name} {theirs:.1f} s"
            f"{'' if k == rounds else ' (est)'} | {theirs / ours:.0f}×{same} |"
        )


def estimate(z, fps):
    """Cycle length [s], or NaN if none is found."""
    try:
        return estimate_period(z, fps).seconds
    except MotionError:
        return np.nan


def accuracy(name, walks, fps):
    """Print errors of the cycle length, complete and with gaps; return the trials beyond the goal."""
    rows, beyond = [], []
    for walk in walks:
        truth = captured_walks.stride_time(walk.legs, fps)
        whole = estimate(walk.angles, fps) / truth - 1
        gaps = [estimate(captured_walks.remove_blocks(walk.angles, seed), fps) / truth - 1 for seed in range(3)]
        rows.append([whole, *gaps])
        if not abs(whole) <= 0.02 or not np.abs(gaps).max() <= 0.03:
            beyond.append(f"{walk.name} {100 * whole:+.1f} % [" + ", ".join(f"{100 * g:+.1f}" for g in gaps) + "]")
    off = np.abs(np.array(rows))
    print(
        f"| {name} | {len(walks)} | {100 * np.median(off[:, 0]):.2f} % | {100 * (off[:, 0] <= 0.02).mean():.1f} % "
        f"| {100 * (off[:, 1:] <= 0.03).mean():.1f} % |"
    )
    return beyond


def false_alarms(seeds):
    """Print the share of noise sequences in which a period is found."""
    for kind in ("white noise", "random walk"):
        for m in (1, 3, 19):
            found = 0
            for seed in range(seeds):
                z = np.random.default_rng(seed).normal(size=(400, m))
                found += np.isfinite(estimate(z if kind == "white noise" else z.cumsum(axis=0), 100))
            print(f"| {kind}, {m} channels | {100 * found / seeds:.1f} % |")


def main() -> None:
    """Print the tables."""
    asked = Arguments(__doc__, mocap=True).parse_args()
    print("| what | ours | peer | ratio |\n|-|-|-|-|")
    speed_of_snr(500 if asked.quick else 5000)
    speed_of_offsets(2 if asked.quick else 8, 100)
    speed_of_offsets(4 if asked.quick else 200, 2)
    print("\n| sequence without a period | a period is found in |\n|-|-|")
    false_alarms(2 if asked.quick else 200)
    if asked.mocap is None:
        return
    print("\n| cycle length | trials | median error | within 2 % | 30 % gone: within 3 % |\n|-|-|-|-|-|")
    cmu = captured_walks.read_cmu(asked.mocap)
    beyond = accuracy("CMU straight walks", cmu, 120)
    beyond += accuracy("santos25", captured_walks.read_santos(asked.mocap), 100)
    print(
        "\nError of each trial beyond 2 % (complete) or 3 % (three runs with gaps, in brackets): " + "; ".join(beyond)
    )
    angles = [walk.angles for walk in cmu]
    count, taken = len(segment(angles, 120).values), shortest(lambda: segment(angles, 120), 1)
    print(f"\n{len(cmu)} CMU walks → {count} cycles in {taken:.2f} s")


if __name__ == "__main__":
    main()
