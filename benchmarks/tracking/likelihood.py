"""Image likelihood: hypotheses per second, and the number of a body's pixels to count as independent.

    motionenv bench tracking.likelihood

Speed: 10,000 random poses including kinematics, compared with rendering each mask and summing log-odds in NumPy.

Tempering: a camera in a random direction sees walkers of random height and girth. Hypotheses are other walkers with
similar phase and position and the average body, weighted by the likelihood with a given number of independent pixels.
The table shows the energy score of the joints [mm, divided by √15], and the share of coordinates inside 90 % intervals.
"""

import numpy as np

import motionenv
from benchmarks import Arguments, shortest
from motionenv.body import from_height, markers
from motionenv.likelihoods import SilhouetteLikelihood
from motionenv.metrics import energy_score
from motionenv.render import Raycaster
from motionenv.render.cameras import view

EFFECTIVE = (0.5, 1, 2, 4, 8, 16, 32, 64)


def speed(n: int) -> None:
    """Print the table of hypotheses per second."""
    rng = np.random.default_rng(0)
    poses = 0.3 * rng.normal(size=(n, 25)) + np.eye(25)[2] * 0.9
    poses[:, 5] = rng.uniform(-np.pi, np.pi, n)
    print("| picture | threads | silhouettes/s | rendered, then NumPy | ratio | depths/s |\n|-|-|-|-|-|-|")
    for size in (64, 128, 256):
        camera = view(0.3, distance=4.0, width=size, height=size)
        for threads in (1, 2):
            caster, model = Raycaster(threads=threads), SilhouetteLikelihood(camera, threads=threads)
            seen = caster.render(poses[0], model.skeleton, camera, rgb=False)
            odds = np.where(seen.limbs > 0, 1.0, -2.0)
            model.observe(mask=seen.limbs)
            fast = n / shortest(lambda model=model: model.log_likelihood(poses), 5, warm=True)
            few = poses[: n // 20]

            def drawn(caster=caster, camera=camera, odds=odds, few=few):
                return ((caster.render(few, from_height(), camera, rgb=False).limbs > 0) * odds).sum((1, 2))

            slow = len(few) / shortest(drawn, 5, warm=True)
            model.observe(depth=seen.depth)
            deep = len(few) / shortest(lambda model=model, few=few: model.log_likelihood(few), 5, warm=True)
            print(f"| {size}² | {threads} | {fast:,.0f} | {slow:,.0f} | {fast / slow:.1f} | {deep:,.0f} |")


def believe(
    sense: str, size: int, distance: float, walkers: int, hypotheses: int
) -> tuple[np.ndarray, np.ndarray, float]:
    """Mean energy score and coverage for each of `EFFECTIVE`, and the mean number of the body's pixels."""
    model = motionenv.load("walk/fpca")
    bank = model.walks(1.2, 30, n=400, seed=3).poses
    rng = np.random.default_rng(1)
    scores, covered, pixels = np.zeros(len(EFFECTIVE)), np.zeros(len(EFFECTIVE)), 0.0
    for _ in range(walkers):
        height = rng.normal(1.72, 0.09)
        body = from_height(height, girth=float(np.exp(0.1 * rng.normal())))
        phase = rng.integers(36)
        pose = bank[rng.integers(400), phase].copy()
        pose[:3] *= [0.0, 0.0, height / model.height_]
        camera = view(rng.uniform(-np.pi, np.pi), width=size, height=size, distance=distance)
        seen = Raycaster().render(pose, body, camera, rgb=False)
        pixels += (seen.limbs > 0).sum() / walkers
        if sense == "occluded":
            seen.limbs[:, size * 7 // 16 : size * 9 // 16] = 0
        others = bank[rng.integers(400, size=hypotheses), (phase + rng.integers(-5, 6, hypotheses)) % 36].copy()
        others[:, :2] = 0.0
        others[:, [0, 1, 2, 5]] += rng.normal(size=(hypotheses, 4)) * [0.1, 0.1, 0.04, 0.15]
        likelihood = SilhouetteLikelihood(camera, effective=None)
        likelihood.observe(**({"depth": seen.depth} if sense == "depth" else {"mask": seen.limbs}))
        logs, area = likelihood.log_likelihood(others), SilhouetteLikelihood(camera, effective=1.0).temper
        x, truth = markers(others, body), markers(pose, body)
        for i, effective in enumerate(EFFECTIVE):
            weights = logs * min(1.0, effective * area)
            scores[i] += energy_score(x[None], weights[None], truth[None])[0] / np.sqrt(15) / walkers
            covered[i] += coverage(x.reshape(-1, 45), weights, truth.reshape(45)) / walkers
    return scores, covered, pixels


def coverage(x: np.ndarray, logs: np.ndarray, truth: np.ndarray) -> float:
    """Share of coordinates of `truth` (45,) inside the central 90 % of the weighted `x` (n, 45)."""
    weights = np.exp(logs - logs.max())
    below = ((x < truth) * (weights / weights.sum())[:, None]).sum(0)
    return float(((below > 0.05) & (below < 0.95)).mean())


def tempering(walkers: int, hypotheses: int) -> None:
    """Print the table of energy scores over numbers of independent pixels."""
    print("\n| observation | pixels of the body |", *(f"{e:g} |" for e in EFFECTIVE), "\n|-|-|" + "-|" * len(EFFECTIVE))
    cases = [("mask", 64, 4.0), ("mask", 64, 8.0), ("mask", 64, 14.0), ("mask", 128, 8.0), ("depth", 64, 8.0)]
    for sense, size, distance in [*cases, ("occluded", 64, 8.0)]:
        scores, covered, pixels = believe(sense, size, distance, walkers, hypotheses)
        cells = [f"{1000 * s:.0f} ({c:.0%}) |" for s, c in zip(scores, covered, strict=True)]
        print(f"| {sense}, {size}², {distance:g} m | {pixels:.0f} |", *cells)


def main() -> None:
    """Print both tables."""
    quick = Arguments(__doc__).parse_args().quick
    speed(40 if quick else 10_000)
    tempering(1 if quick else 40, 20 if quick else 1500)


if __name__ == "__main__":
    main()
