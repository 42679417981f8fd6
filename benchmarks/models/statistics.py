"""Functional PCA as a distribution, on people left out: shares of variance, likelihood, and bands.

    motionenv bench models.statistics [--mocap FOLDER]

Cycles are those of CMU's straight walks, the 19 joint angles. Shares: what q components explain of the model's own
variance, and the variance of what the model draws relative to that of the cycles, with noise and without. Likelihood:
log-likelihood per seen sample of each person's cycles, from the model of the others, the median of the cycles and the
mean over people; by number of components, kind of noise, harmonics of the residuals, and least share of a cycle that is
used. Bands: of people left out, a fifth of each cycle hidden in blocks, how many hidden samples lie within their 90 %
bands, and of how many cycles all do; and how often the means of two halves of people differ by less than their bands
together, at single phases and at all phases of an angle. Settings were chosen by the likelihood; the bands weren't
looked at for that.
"""

import time
import warnings
from itertools import product

import numpy as np

from benchmarks import Arguments
from benchmarks.captured_walks import SAME_PERSON, read_cmu
from benchmarks.models.imputation import hide_blocks
from benchmarks.models.multilevel import MultilevelFPCA
from motionenv import FunctionalPCA, segment
from motionenv.errors import FitWarning
from motionenv.types import Cycles


def cmu_cycles(mocap) -> Cycles:
    """Cycles of the straight CMU walks, labelled by person."""
    walks = read_cmu(mocap)
    people = [SAME_PERSON.get(walk.name[:2], walk.name[:2]) for walk in walks]
    return segment([walk.angles for walk in walks], 120.0, subjects=people)


def shares(cycles: Cycles, numbers) -> None:
    """What components explain, and what is drawn."""
    print("\n| method, noise | q | seconds | iterations | explained | noise | drawn / cycles | … without noise |")
    print("|-|-|-|-|-|-|-|-|")
    variance = np.nanvar(cycles.values, axis=0).sum()
    kinds = (("ppca", "channel"), ("ppca", "shared"), ("svd", "channel"))
    for (method, noise), q in product(kinds, numbers):
        start = time.perf_counter()
        model = FunctionalPCA(q, method=method, noise=noise).fit(cycles)
        seconds = time.perf_counter() - start
        drawn = [model.sample(4000, 0, noise=n).var(axis=0).sum() / variance for n in (True, False)]
        count = f"{model.n_iter_}{'' if model.converged_ else ', not converged'}"
        told = model.explained_variance_ratio_.sum(), model.noise_ratio_, *drawn
        print(f"| {method}, {noise} | {q} | {seconds:.2f} | {count} | {' | '.join(f'{x:.2f}' for x in told)} |")


def left_out(cycles: Cycles, q: int, **settings) -> float:
    """Log-likelihood per sample of each person's median cycle, from a model of the others; mean over people."""
    found, who = [], np.array(cycles.subject)
    for person in np.unique(who):
        own = cycles.values[who == person]
        seen = np.isfinite(own).sum(axis=(1, 2))
        model = FunctionalPCA(q, **settings).fit(cycles[who != person])
        found.append(np.median(model.score_samples(own)[seen > 0] / seen[seen > 0]))
    return float(np.mean(found))


def likelihood(cycles: Cycles, numbers) -> None:
    """Settings on people left out."""
    print(f"\n| log-likelihood per sample, people left out | {' | '.join(f'q = {q}' for q in numbers)} |")
    print(f"|-|{'-|' * len(numbers)}")
    rows = [{"noise": noise, "residual_harmonics": n} for noise in ("channel", "shared") for n in (0, 4, 8, 12)]
    rows += [{"least_seen": share} for share in (0.0, 0.2, 0.5, 0.8)]
    for settings in rows:
        title = ", ".join(f"{name}={value!r}" for name, value in settings.items())
        print(f"| {title} | {' | '.join(f'{left_out(cycles, q, **settings):.3f}' for q in numbers)} |")


def bands(cycles: Cycles, draws: int) -> None:
    """Coverage of bands around filled samples and around the mean."""
    who, found = np.array(cycles.subject), []
    people = np.unique(who)
    for person in people:
        model = FunctionalPCA(min(5, len(people) // 2)).fit(cycles[who != person])
        truth = cycles.values[who == person]
        hidden = hide_blocks(truth, 0.2, seed=0) & np.isfinite(truth)
        values = np.where(hidden, np.nan, truth)
        filled, one = model.impute(values, return_band=True)
        every = model.impute(values, return_band=True, simultaneous=True)[1]
        some = hidden.any(axis=(1, 2))
        inside = (np.abs(filled - truth) <= every) | ~hidden
        found.append(((np.abs(filled - truth) <= one)[hidden].mean(), inside.all(axis=(1, 2))[some].mean()))
    rng, means = np.random.default_rng(0), []
    for _ in range(draws):
        half = np.isin(who, rng.permutation(people)[: len(people) // 2])
        one, other = (FunctionalPCA(1, tol=1e-3).fit(cycles[part]) for part in (half, ~half))
        off = np.abs(one.mean_ - other.mean_)
        widths = [np.hypot(one.mean_band(simultaneous=s), other.mean_band(simultaneous=s)) for s in (False, True)]
        means.append(((off <= widths[0]).mean(), (off <= widths[1]).all(axis=0).mean()))
    print("\n| 90 % bands | at single samples | at all at once |\n|-|-|-|")
    for title, rows in (("filled samples of people left out", found), ("difference of two halves' means", means)):
        print(f"| {title} | {' | '.join(f'{100 * x:.0f} %' for x in np.mean(rows, axis=0))} |")


def levels(cycles: Cycles, numbers) -> None:
    """People left out by what their strides share: cycles for themselves, and people's covariance raw and shrunk."""
    print("\n| log-likelihood per person left out, over that of independent cycles | seconds | ICC | noise |")
    print("|-|-|-|-|")
    who = np.array(cycles.subject)
    for q in numbers:
        for shrinkage in (0.0, "likelihood", np.inf):
            start = time.perf_counter()
            whole = MultilevelFPCA(q, shrinkage=shrinkage).fit(cycles)
            seconds, gains = time.perf_counter() - start, []
            for person in np.unique(who):
                model = MultilevelFPCA(q, shrinkage=shrinkage).fit(cycles[who != person])
                alone = model.fpca_.score_samples(cycles[who == person]).sum()
                gains.append(model.effects(cycles[who == person])[1].log_p - alone)
            title = f"q = {q}, shrinkage {shrinkage} ({whole.shrinkage_:g}): {np.mean(gains):.1f}"
            print(f"| {title} | {seconds:.2f} | {whole.icc_:.2f} | {whole.noise_ratio_:.2f} |", flush=True)


def main() -> None:
    """Print the tables."""
    parser = Arguments(__doc__, mocap=("cmu_asfamc",))
    parser.add_argument("--draws", type=int, default=100, quick=1, help="pairs of halves of the people")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore", FitWarning)
    cycles = cmu_cycles(arguments.mocap)
    if arguments.quick:
        cycles = cycles[::4]
    print(f"{len(cycles)} cycles of {len(set(cycles.subject))} people, {np.isnan(cycles.values).mean():.0%} missing")
    shares(cycles, (2,) if arguments.quick else (2, 5, 10, 20))
    likelihood(cycles, (1,) if arguments.quick else (1, 2, 3, 4, 5, 8, 12))
    levels(cycles, (2,) if arguments.quick else (5, 10, 20))
    bands(cycles, arguments.draws)


if __name__ == "__main__":
    main()
