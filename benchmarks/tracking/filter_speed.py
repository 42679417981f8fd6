"""Frames per second of a whole particle filter, compared with the `particles` library and a NumPy model.

    motionenv bench tracking.filter_speed

The FPCA prior (paper A, section 5) tracks a walker in masks, with silhouettes. Each step observes,
propagates, weights and resamples. The peer is Chopin's `particles` 0.4. It requires numpy < 2 but runs with numpy 2, so
it can't be an extra: `pip install --no-deps particles joblib`. It resamples as ours does. Its model is vectorised, with
noise of the same form, the same table, tempering and log-odds, and kinematics by matrices without levelled feet. It
does less work: it looks up a dozen points per limb instead of whole silhouettes, ignores occlusion of outlines, and
preprocesses the masks before timing.
The tree prior (paper C) tracks the same walks with silhouettes only, without a peer.
Times are CPU time for one thread, less affected by other jobs, and wall-clock time for two.
"""

import importlib
import resource
import time

import numpy as np

import motionenv
from benchmarks import Arguments, has
from motionenv.body.limbs import LIMB_NODES, LIMB_SEGMENT, LIMB_SHIFTS
from motionenv.likelihoods.silhouette import SilhouetteLikelihood
from motionenv.render import Raycaster
from motionenv.render.cameras import view
from motionenv.tracking.particle_filter import ParticleFilter
from motionenv.tracking.priors.base import Start
from motionenv.tracking.priors.fpca import FPCAPrior
from motionenv.tracking.priors.tree import TreePrior

CHAINS = (
    (9, 3, 5, 7, -1, 1, -1, 2),
    (13, 4, 6, 8, -1, -1, -1, 4),
    (17, 9, 11, 13, -1, 1, 1, 6),
    (21, 10, 12, 14, -1, -1, 1, 8),
)


class Timed:
    """Wraps a method of an object to accumulate its time."""

    def __init__(self, of, name: str, clock):
        self.work, self.clock, self.seconds = getattr(of, name), clock, 0.0
        setattr(of, name, self)

    def __call__(self, *args, **kwargs):
        """Call the method."""
        start = self.clock()
        result = self.work(*args, **kwargs)
        self.seconds += self.clock() - start
        return result


def turn(axis: int, angle: np.ndarray) -> np.ndarray:
    """Rotations (n, 3, 3) about a coordinate axis."""
    c, s, out = np.cos(angle), np.sin(angle), np.zeros((len(angle), 3, 3))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    out[:, axis, axis], out[:, i, i], out[:, j, j], out[:, i, j], out[:, j, i] = 1.0, c, c, -s, s
    return out


def numpy_ends(poses: np.ndarray, body) -> np.ndarray:
    """Ends of the limbs (n, limbs, 2, 3) in NumPy, with feet fixed to the shins."""
    n, o = len(poses), body.offsets
    nodes, frames = np.empty((n, 16, 3)), np.empty((n, 12, 3, 3))
    frames[:, 0] = turn(2, poses[:, 5]) @ turn(0, poses[:, 4]) @ turn(1, poses[:, 3])
    nodes[:] = poses[:, None, :3] + np.einsum("nij,kj->nki", frames[:, 0], o)
    frames[:, 1] = frames[:, 0] @ turn(1, poses[:, 6]) @ turn(0, -poses[:, 7]) @ turn(2, poses[:, 8])
    nodes[:, 0] = nodes[:, 15] + frames[:, 1] @ o[0]
    for at, near, middle, far, flexion, side, hinge, segment in CHAINS:
        angles = turn(1, flexion * poses[:, at]) @ turn(0, side * poses[:, at + 1]) @ turn(2, -side * poses[:, at + 2])
        frames[:, segment] = frames[:, 0] @ angles
        frames[:, segment + 1] = frames[:, segment] @ turn(1, hinge * poses[:, at + 3])
        nodes[:, middle] = nodes[:, near] + frames[:, segment] @ o[middle]
        nodes[:, far] = nodes[:, middle] + frames[:, segment + 1] @ o[far]
    frames[:, 10], frames[:, 11] = frames[:, 7], frames[:, 9]
    return nodes[:, LIMB_NODES] + np.einsum("nlij,lej->nlei", frames[:, LIMB_SEGMENT], LIMB_SHIFTS * body.height)


def numpy_score(poses, body, camera, inside) -> np.ndarray:
    """Log-likelihood (n,) from the picture `inside` at points on limbs."""
    x = numpy_ends(poses, body) @ camera.R.T + camera.t
    z = x[..., 2:]
    circles = x[..., :2] / z * camera.K[[0, 1], [0, 1]] + camera.K[:2, 2]
    radius = camera.K[1, 1] * body.radii[..., None] / z
    a, b, total = circles[:, :, 0], circles[:, :, 1], np.zeros(len(poses))
    axis = b - a
    length = np.sqrt((axis**2).sum(-1, keepdims=True)) + 1e-9
    normal = np.stack([-axis[..., 1], axis[..., 0]], axis=-1) / length
    last = np.array([camera.width - 1, camera.height - 1])
    for s in (0.125, 0.375, 0.625, 0.875):
        r = radius[:, :, 0] + s * (radius[:, :, 1] - radius[:, :, 0])
        share = length * r / 6
        for side in (-0.67, 0.0, 0.67):
            at = np.clip(np.rint(a + s * axis + side * r * normal), 0, last).astype(np.intp)
            total += (share[..., 0] * inside[at[..., 1], at[..., 0]]).sum(axis=1)
    return total


def peer(n: int, masks, prior: FPCAPrior, silhouettes: SilhouetteLikelihood, start: np.ndarray):
    """The same filter with the `particles` library; returns the function that runs it."""
    particles = importlib.import_module("particles")  # can't be declared: see above
    table, q = prior.table, len(prior.root)
    rest, pace = prior.deviation[:25], prior.deviation[25]
    pictures = []
    for mask in masks:
        silhouettes.observe(mask=mask)
        pictures.append(silhouettes.odds()[0] * silhouettes.temper)
    body, camera = prior.skeleton, silhouettes.camera
    rng = np.random.default_rng(0)

    class Walking(particles.FeynmanKac):
        """Columns: scores, phase, log pace, heading, place, δ, pose."""

        def M0(self, N):
            x = np.zeros((N, q + 55))
            x[:, q + 3 : q + 5] = start[:2]
            return self.M(0, x)

        def M(self, t, xp):
            x = xp.copy()
            x[:, :q] = 0.98 * xp[:, :q] + 0.2 * rng.standard_normal((len(x), q)) @ prior.root.T
            x[:, q + 1] = 0.98 * xp[:, q + 1] + 0.02 * pace * rng.standard_normal(len(x))
            turned = np.exp(prior.log_pace + x[:, q + 1]) / 30 + 0.003 * rng.standard_normal(len(x))
            x[:, q] += turned
            x[:, q + 2] += 0.01 * rng.standard_normal(len(x))
            x[:, q + 5 : q + 30] = 0.93 * xp[:, q + 5 : q + 30] + 0.3 * rest * rng.standard_normal((len(x), 25))
            at = x[:, q] % 1 * len(table)
            first = at.astype(np.intp) % len(table)
            u = (at - at.astype(np.intp))[:, None, None]
            rows = (1 - u) * table[first] + u * table[(first + 1) % len(table)]
            channels = rows[:, 0] + (x[:, None, :q] @ rows[:, 1:])[:, 0]
            c, s = np.cos(x[:, q + 2]), np.sin(x[:, q + 2])
            way = channels[:, :2] * turned[:, None] + 0.005 * rng.standard_normal((len(x), 2))
            x[:, q + 3] += c * way[:, 0] - s * way[:, 1]
            x[:, q + 4] += s * way[:, 0] + c * way[:, 1]
            x[:, q + 30 :] = channels + x[:, q + 5 : q + 30]
            x[:, q + 30 : q + 32] = x[:, q + 3 : q + 5]
            x[:, q + 35] += x[:, q + 2]
            return x

        def logG(self, t, xp, x):
            return numpy_score(x[:, q + 30 :], body, camera, pictures[t])

    return particles.SMC(fk=Walking(T=len(masks)), N=n, resampling="systematic", ESSrmin=0.5).run


def scene(size: int, frames: int):
    """A prior, a camera, and the masks and poses of a walk."""
    prior = FPCAPrior()
    poses = motionenv.load("walk/fpca").walks(frames / 30 + 0.1, 30, n=1, seed=1).poses[0][:frames]
    poses = poses - np.r_[poses[:, :2].mean(axis=0), np.zeros(23)]
    camera = view(0.0, width=size, height=size)
    return prior, camera, Raycaster().render(poses, prior.skeleton, camera, rgb=False).limbs > 0, poses


def ours(n: int, size: int, threads: int, frames: int, tree: bool = False) -> tuple[float, float, float]:
    """Frames per second, and shares of time in likelihood and prior; with the tree prior if `tree`."""
    prior, camera, masks, poses = scene(size, frames)
    clock = time.process_time if threads == 1 else time.perf_counter
    likelihood = SilhouetteLikelihood(camera, prior.skeleton, threads=threads)
    if tree:
        prior = TreePrior(skeleton=prior.skeleton)
    tracker = ParticleFilter(prior, likelihood, n, seed=0)
    tracker.start(Start.at(poses[0]))
    tracker.step(mask=masks[0])
    tracker.step(mask=masks[1])
    observing, scoring = Timed(likelihood, "observe", clock), Timed(likelihood, "log_likelihood", clock)
    moving = Timed(prior, "propagate", clock)
    began = clock()
    for mask in masks[2:]:
        tracker.step(mask=mask)
    seconds = clock() - began
    return (frames - 2) / seconds, (observing.seconds + scoring.seconds) / seconds, moving.seconds / seconds


def theirs(n: int, size: int, frames: int) -> float:
    """Frames per second of the peer."""
    prior, camera, masks, poses = scene(size, frames)
    run = peer(n, masks, prior, SilhouetteLikelihood(camera, prior.skeleton), poses[0])
    began = time.process_time()
    run()
    return frames / (time.process_time() - began)


def table(frames: int, counts: tuple[int, ...], peer: bool) -> None:
    """Print frames per second, with the share of each part."""
    print("| prior | picture | N | threads | frames/s | likelihood | prior | rest | `particles` | ratio |")
    print("|-|-|-|-|-|-|-|-|-|-|")
    for size in (64, 128):
        for n in counts:
            count = frames if n == 10_000 else 2 * frames
            other = theirs(n, size, max(3, frames // 4)) if peer else np.nan
            for threads in (1, 2):
                rate, *shares = ours(n, size, threads, count)
                row("functional", size, n, threads, rate, shares, f"{other:.1f} | {rate / other:.1f}")
    for threads in (1, 2):
        rate, *shares = ours(counts[0], 128, threads, 4 * frames, tree=True)
        row("tree", 128, counts[0], threads, rate, shares, "|")


def row(prior: str, size: int, n: int, threads: int, rate: float, shares: list[float], peer: str) -> None:
    """Print a row of the table."""
    parts = f"{shares[0]:.0%} | {shares[1]:.0%} | {1 - sum(shares):.0%}"
    print(f"| {prior} | {size}² | {n:,} | {threads} | {rate:.1f} | {parts} | {peer} |")


def main() -> None:
    """Print the table, and the memory of many particles."""
    quick, peer = Arguments(__doc__).parse_args().quick, has("particles")
    ours(32, 64, 1, 3), ours(32, 64, 1, 3, tree=True)  # compile
    if peer:
        theirs(32, 64, 3)
    table(3 if quick else 40, (30,) if quick else (300, 1_000, 10_000), peer)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    ours(1_000 if quick else 100_000, 64, 2, 4)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(f"\nMemory at N = 100,000: at most {peak / 1024:.0f} MB in all ({before / 1024:.0f} MB before).")


if __name__ == "__main__":
    main()
