"""Total variation between the motion tree's draws and p(c_i | c_t) by brute force, on real capture.

    motionenv bench tree.accuracy [--mocap FOLDER]

The database holds four fifths of the clips; the 64 probes are windows of the others. Cells are means over probes, with
the worst in brackets. For the tree, the distribution itself is evaluated: its log-probability of every window. For
`exact`, draws are counted; as many draws by NumPy's multinomial from the brute-force distribution show what an exact
sampler achieves. Draws are also counted in 50 groups of windows of equal probability, from near to far, which would
reveal a sampler that truncates the tail.
"""

import numpy as np

from benchmarks.tree.capture import capture, held_out, histories, options
from benchmarks.tree.probabilities import log_prob
from motionenv.models.motion_tree.model import MotionTree

TEMPERATURES = (0.002, 0.05, 0.2, 1.0)
GROUPS = 50


def brute_force(z: np.ndarray, probe: np.ndarray, temperature: float) -> np.ndarray:
    """Probabilities (n,) of all windows with coefficients z (n, b), in double precision."""
    away = ((z.astype(float) - probe.astype(float)) ** 2).sum(1)
    weights = np.exp((away.min() - away) / (2 * temperature))
    return weights / weights.sum()


def variation(p: np.ndarray, q: np.ndarray) -> float:
    """Total variation between distributions (n,); mass that `q` lacks counts as lying elsewhere."""
    return 0.5 * float(np.abs(p - q).sum() + abs(1 - q.sum()))


def grouped(p: np.ndarray) -> np.ndarray:
    """Group (n,) of each window; groups have equal probability, from the nearest to the farthest windows."""
    order = np.argsort(-p)
    groups = np.empty(len(p), int)
    groups[order] = np.minimum((np.cumsum(p[order]) - 1e-12) * GROUPS, GROUPS - 1).astype(int)
    return groups


def counted(p: np.ndarray, drawn: np.ndarray) -> tuple[float, float]:
    """Total variation between counts `drawn` (n,) and p (n,), over windows and over groups."""
    q, groups = drawn / drawn.sum(), grouped(p)
    return variation(p, q), variation(*(np.bincount(groups, x, GROUPS) for x in (p, q)))


def row(known: dict[str, MotionTree], probes: np.ndarray, temperature: float, draws: int) -> list[np.ndarray]:
    """For each probe: perplexity; total variation of four trees, and of counts."""
    tree = known["sign"]
    n = tree.index_.n
    everything = np.arange(n, dtype=np.int32)
    z = tree.index_.coefficients(everything)
    of_tree = {s: np.ascontiguousarray(m.index_.coefficients(everything)) for s, m in known.items()}
    rng = np.random.default_rng(0)
    rows = []
    for i, probe in enumerate(probes):
        p = brute_force(z, probe, temperature)
        found = [np.exp(-(p[p > 0] * np.log(p[p > 0])).sum())]
        for splits, model in known.items():
            mine = p if splits == "sign" else brute_force(of_tree[splits], probe, temperature)
            for leaf in ("uniform", "kernel"):
                log = log_prob(model.descent_, probe[None], everything[None], temperature, leaf, model.index_.blocks)
                found.append(variation(mine, np.exp(log[0])))
        exact = np.bincount(tree.index_.draw(probe[None], draws, temperature, key=i)[0][0], minlength=n)
        found += np.stack([counted(p, exact), counted(p, rng.multinomial(draws, p))], axis=1).ravel().tolist()
        rows.append(found)
    return list(np.array(rows).T)


def main() -> None:
    """Print the table."""
    asked = options(__doc__).parse_args()
    database, others = held_out(capture(asked))
    known = {splits: MotionTree(splits=splits).fit_database(database) for splits in ("sign", "median")}
    count, draws = (1, 500) if asked.quick else (64, 200_000)
    probes = known["sign"].coefficients(histories(others, count)[0])
    tree = known["sign"]
    print(
        f"n = {tree.index_.n:,} windows, b = {tree.descent_.depth}, {count} probes, {draws:,} draws from each. "
        "Total variation to the brute-force distribution.\n"
    )
    print(
        "| β | perplexity | tree, sign splits, uniform leaf | kernel leaf | median splits, uniform | kernel leaf",
        end="",
    )
    print(" | exact, draws | multinomial, draws | exact, groups", end="")
    print(f" | multinomial, groups |\n|{'-|' * 10}")
    for temperature in TEMPERATURES:
        perplexity, *variations = row(known, probes, temperature, draws)
        cells = [f"{v.mean():.4f} ({v.max():.4f})" if i >= 4 else f"{v.mean():.2f}" for i, v in enumerate(variations)]
        print(f"| {temperature:g} | {perplexity.mean():.0f} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
