"""How far the draws of the motion tree are from p(c_i | c_t) by brute force: total variation, real capture.

    python benchmarks/tree_accuracy.py [--mocap FOLDER] [--quick]

64 probes are windows of held-out clips, the database is of the others; the mean over the probes is given, and the worst
in brackets. The tree's distribution is computed, not drawn (its log probability of every window). What `exact` draws is
counted, and as many draws by NumPy's multinomial from the brute-force distribution, counted alike, are what an exact
sampler would show. So that this doesn't hide an error, draws are also counted in 50 groups of windows of
equal probability, from near to far: a sampler that cut off what is far would miss the last ones.
"""

import numpy as np
from bandai import capture, held_out, histories, options

from motionenv.models.tree.model import MotionTree

TEMPERATURES = (0.002, 0.05, 0.2, 1.0)
GROUPS = 50


def brute_force(z: np.ndarray, probe: np.ndarray, temperature: float) -> np.ndarray:
    """Probabilities (n,) of all windows, with coefficients z (n, b), double precision."""
    away = ((z.astype(float) - probe.astype(float)) ** 2).sum(1)
    weights = np.exp((away.min() - away) / (2 * temperature))
    return weights / weights.sum()


def variation(p: np.ndarray, q: np.ndarray) -> float:
    """Total variation between distributions (n,); what `q` lacks to 1 lies elsewhere."""
    return 0.5 * float(np.abs(p - q).sum() + abs(1 - q.sum()))


def grouped(p: np.ndarray) -> np.ndarray:
    """A group (n,) for each window: from the likeliest, the nearest, to the farthest, about equally likely each."""
    order = np.argsort(-p)
    groups = np.empty(len(p), int)
    groups[order] = np.minimum((np.cumsum(p[order]) - 1e-12) * GROUPS, GROUPS - 1).astype(int)
    return groups


def counted(p: np.ndarray, drawn: np.ndarray) -> tuple[float, float]:
    """Total variation of counts `drawn` (n,) to p (n,): over windows, and over groups of them."""
    q, groups = drawn / drawn.sum(), grouped(p)
    return variation(p, q), variation(*(np.bincount(groups, x, GROUPS) for x in (p, q)))


def row(known: dict[str, MotionTree], probes: np.ndarray, temperature: float, draws: int) -> list[np.ndarray]:
    """Per probe: perplexity, four variations of the tree's, of `exact`'s sum, and of both samplers' counts."""
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
                log = model.descent_.log_prob(probe[None], everything[None], temperature, leaf, model.index_.blocks)
                found.append(variation(mine, np.exp(log[0])))
        log = tree.index_.log_kernel(probe[None], everything[None], temperature)[0]
        found.append(variation(p, np.exp(log - tree.index_.log_normaliser(probe[None], temperature))))
        exact = np.bincount(tree.index_.draw(probe[None], draws, temperature, key=i)[0], minlength=n)
        found += np.stack([counted(p, exact), counted(p, rng.multinomial(draws, p))], axis=1).ravel().tolist()
        rows.append(found)
    return list(np.array(rows).T)


def main() -> None:
    """Print the table."""
    asked = options(__doc__).parse_args()
    database, others = held_out(capture(asked))
    known = {splits: MotionTree(splits=splits).fit(database) for splits in ("sign", "median")}
    count, draws = (8, 20_000) if asked.quick else (64, 200_000)
    probes = known["sign"].coefficients(histories(others, count)[0])
    tree = known["sign"]
    print(
        f"n = {tree.index_.n:,} windows, b = {tree.descent_.depth}, {count} probes, {draws:,} draws of each counted.\n"
    )
    print(
        "| β | perplexity | tree, sign splits, uniform leaf | kernel leaf | median splits, uniform | kernel leaf",
        end="",
    )
    print(" | exact: the probability it states | exact, counted | multinomial, counted | exact, groups", end="")
    print(f" | multinomial, groups |\n|{'-|' * 11}")
    for temperature in TEMPERATURES:
        perplexity, *variations = row(known, probes, temperature, draws)
        cells = [f"{v.mean():.4f} ({v.max():.4f})" if i >= 4 else f"{v.mean():.2f}" for i, v in enumerate(variations)]
        print(f"| {temperature:g} | {perplexity.mean():.0f} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
