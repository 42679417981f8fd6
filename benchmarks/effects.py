"""Do comparisons of people find what isn't there? Simulated error rates, coverage of bands, and a peer.

    motionenv bench effects [--repeats 4000]

Curves are smooth random ones of 25 phases, without a difference, in three designs. The peer is spm1d's permutation test
(Pataky 2016) of the plantar arch angles of ten people at two speeds (Caravaggi et al. 2010), which come with it.
"""

import time

import numpy as np

from benchmarks import Arguments, needs

needs("spm1d")
import spm1d

from motionenv.gait import effect_of

PHASES, FLIPS = 25, 199


def smooth(n: int, rng: np.random.Generator) -> np.ndarray:
    """Smooth random curves (n, phases)."""
    x = np.linspace(0, 1, PHASES)
    return rng.standard_normal((n, 7)) @ np.cos(np.pi * np.outer(np.arange(7), x)) / np.sqrt(7)


def paired(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, int]:
    """Differences of nine people."""
    return smooth(9, rng), np.ones((9, 1)), 0


def groups(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, int]:
    """Eight people, and twelve who differ 1.5 times as much."""
    return np.concatenate([smooth(8, rng), 1.5 * smooth(12, rng)]), np.column_stack([np.ones(20), np.arange(20) > 7]), 1


def slope(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, int]:
    """A predictor of fifteen people, beside another that has an effect."""
    age = rng.uniform(20, 70, 15)
    return smooth(15, rng) + 0.1 * age[:, None], np.column_stack([np.ones(15), rng.uniform(1, 2, 15), age]), 1


def main() -> None:
    """Print the tables."""
    parser = Arguments(__doc__)
    parser.add_argument("--repeats", type=int, default=4000, quick=20, help="simulations of each design (4000)")
    repeats, rng = parser.parse_args().repeats, np.random.default_rng(0)
    print("| no difference, 5 % level | found to differ | 95 % bands hold all of it |\n|-|-|-|")
    for title, design in (("9 pairs", paired), ("8 and 12 people of unequal spread", groups),
                          ("a predictor beside another, 15 people", slope)):  # fmt: skip
        found = [effect_of(*design(rng), permutations=FLIPS, seed=rng) for _ in range(repeats)]
        wrong = np.mean([effect.p <= 0.05 for effect in found])
        inside = np.mean([(np.abs(effect.estimate) <= effect.band).all() for effect in found])
        print(f"| {title} | {wrong:.1%} | {inside:.1%} |", flush=True)
    slow, fast = spm1d.data.uv1d.tpaired.PlantarArchAngle().get_data()
    began = time.perf_counter()
    own = effect_of(slow - fast, np.ones((len(slow), 1)), 0)
    middle = time.perf_counter()
    peer = spm1d.stats.nonparam.ttest_paired(slow, fast).inference(0.05, two_tailed=True, iterations=-1)
    ended = time.perf_counter()
    cells = (f"{own.threshold:.2f}", f"{peer.zstar:.2f}", f"{(ended - middle) / (middle - began):.0f}x")
    print("\n| plantar arch, all 1,024 sign flips | threshold | spm1d's | spm1d's time / ours |\n|-|-|-|-|")
    print(f"| largest difference {np.abs(own.t).max():.1f} standard errors | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
