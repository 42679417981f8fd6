"""`ParticleFilter` beside other libraries' filters and smoothers, on the same models and the same data.

    motionenv bench tracking.peers [--clips 10] [--runs 10] [--particles 1024]

The body deviates from a known walk (`GuidedPrior`: independent autoregressions that keep 0.2 s), and its 15 markers are
seen in an orthographic view with Gaussian noise (`MarkerLikelihood`), for 40 frames at 30 frames/s:

- "place": two unknowns, the root's position in the picture, and noise of 60 mm; linear and Gaussian, so that Kalman's
  filter and smoother are exact.
- "posture": nine unknowns, also heading and the flexions of shoulders, hips and knees, and noise of 150 mm; the angles
  make it nonlinear. Its log evidence is that of guided filters with five times as many particles, averaged over four.

Each of the clips is drawn from the model, and filtered in several runs. Error: mean distance of the mean state's
markers from the true ones [mm]. Log evidence of a clip: mean and standard deviation of its difference from the
reference. Coverage: share of unknowns inside central 90 % bands. Seconds (CPU) are those of a clip. Intervals are 95 %,
over clips.

Peers: `filterpy` (Kalman and unscented filters; Labbe), `particles` (Chopin & Papaspiliopoulos 2020): bootstrap, guided
by the optimal proposal (of the model linearised at the mean), SQMC, and FFBS with 256 trajectories. All filters of
particles resample systematically below half the effective sample size, but SQMC, which always does. `particles` 0.4
asks for NumPy 1 but runs with NumPy 2.4: `pip install --no-deps particles`.
"""

import importlib
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks import Arguments, needs
from benchmarks.tracking.tables import cell, mean
from motionenv import synthesize
from motionenv.body import markers
from motionenv.likelihoods import MarkerLikelihood
from motionenv.render.cameras import orthographic
from motionenv.tracking import ParticleFilter, Start
from motionenv.tracking.priors.guided import GuidedPrior
from motionenv.types import POSE, Skeleton

FPS, FRAMES, MEMORY, VIEW = 30.0, 40, 0.2, 0.6  # [Hz], frames, [s], [rad]
PLACE, ANGLE = 0.15, 0.25  # deviations of positions [m] and angles [rad]
NOISE = {"place": 0.06, "posture": 0.15}  # of points [m]
FLEXIONS = [f"{side}_{joint}_flexion" for side in ("left", "right") for joint in ("shoulder", "hip", "knee")]
PLACED = ("root_x", "root_z")
UNKNOWN = {"place": PLACED, "posture": (*PLACED, "root_heading", *FLEXIONS)}
PATHS = 256  # trajectories of a smoother
MANY, TIMES = 5, 4  # particles of the reference, relative to the filters', and its runs


@dataclass(frozen=True, eq=False)
class Clip:
    """A model and what it drew.

    Attributes:
        skeleton, guide: the body, and its known walk (frames, 25).
        which: entries (d,) of the pose that deviate, by `deviation` (d,).
        noise: of points [m].
        truth: (frames, d) deviations.
        points: (frames, 15, 2) [m].
    """

    skeleton: Skeleton
    guide: np.ndarray
    which: np.ndarray
    deviation: np.ndarray
    noise: float
    truth: np.ndarray
    points: np.ndarray

    keep = float(np.exp(-1 / (MEMORY * FPS)))

    @property
    def change(self) -> np.ndarray:
        """Covariance (d, d) of a step's noise."""
        return np.diag((1 - self.keep**2) * self.deviation**2)

    def joints(self, t: int, x: np.ndarray) -> np.ndarray:
        """Markers (n, 15, 3) of deviations (n, d) in frame `t`."""
        poses = np.repeat(self.guide[t][None], len(x), axis=0)
        poses[:, self.which] += x
        return markers(poses, self.skeleton)

    def seen(self, t: int, x: np.ndarray) -> np.ndarray:
        """Their points (n, 30)."""
        return orthographic(self.joints(t, x), VIEW).reshape(len(x), -1)

    def slopes(self, t: int, x: np.ndarray, step: float = 1e-4) -> np.ndarray:
        """Derivatives (30, d) of the points at deviations (d,)."""
        off = step * np.eye(len(x))
        return ((self.seen(t, x + off) - self.seen(t, x - off)) / (2 * step)).T


@dataclass(frozen=True, eq=False)
class Answer:
    """Means and levels of the truth (frames, d) in the belief, and the clip's log evidence; NaN of smoothers."""

    means: np.ndarray
    levels: np.ndarray
    evidence: float = np.nan


def clip(model: str, seed: int, frames: int) -> Clip:
    """A clip drawn from a model of `UNKNOWN`."""
    rng = np.random.default_rng([40, seed])
    walk = synthesize("walk/fpca", seconds=FRAMES / FPS, fps=FPS, seed=seed)
    which = np.array([POSE.index(name) for name in UNKNOWN[model]])
    deviation = np.where(which < 3, PLACE, ANGLE)
    empty = Clip(walk.skeleton, walk.poses[:frames], which, deviation, NOISE[model], np.empty(0), np.empty(0))
    truth = np.empty((frames, len(which)))
    truth[0] = deviation * rng.standard_normal(len(which))
    for t in range(1, frames):
        truth[t] = empty.keep * truth[t - 1] + np.sqrt(np.diag(empty.change)) * rng.standard_normal(len(which))
    exact = np.concatenate([empty.seen(t, truth[t : t + 1]) for t in range(frames)]).reshape(frames, 15, 2)
    points = exact + NOISE[model] * rng.standard_normal(exact.shape)
    return Clip(walk.skeleton, walk.poses[:frames], which, deviation, NOISE[model], truth, points)


def ours(clip: Clip, n: int, seed: int) -> Answer:
    deviation = np.zeros(len(POSE))
    deviation[clip.which] = clip.deviation
    prior = GuidedPrior(clip.guide, deviation, skeleton=clip.skeleton, fps=FPS, memory=MEMORY)
    likelihood = MarkerLikelihood(VIEW, clip.skeleton, noise=clip.noise, outliers=1e-12)
    tracker = ParticleFilter(prior, likelihood, n, hidden=0.0, seed=seed)
    tracker.start(Start.at(clip.guide[0], spread=deviation))
    found = [tracker.step(points=points) for points in clip.points]
    x = [(b.poses - guide)[:, clip.which] for b, guide in zip(found, clip.guide, strict=True)]
    return weighted(clip, x, [np.exp(b.log_weights) for b in found], sum(b.log_evidence for b in found))


def weighted(clip: Clip, x: list, weights: list, evidence: float = np.nan) -> Answer:
    """Of particles (n, d) and normalised weights (n,) in each frame."""
    means = np.stack([w @ p for p, w in zip(x, weights, strict=True)])
    levels = np.stack([w @ (p < true) for p, w, true in zip(x, weights, clip.truth, strict=True)])
    return Answer(means, levels, evidence)


def gaussian(clip: Clip, means: list, variances: list, evidence: float = np.nan) -> Answer:
    """Of means (d,) and covariances (d, d) in each frame."""
    from scipy.stats import norm

    means, spread = np.array(means), np.sqrt([np.diag(v) for v in variances])
    return Answer(means, norm.cdf((clip.truth - means) / spread), evidence)


def followed(clip: Clip, model, smooth: bool, update) -> Answer:
    """What `model` of filterpy says of a clip: `update(t, points)` corrects it by the points of frame t."""
    means, variances, evidence = [], [], 0.0
    for t, points in enumerate(clip.points):
        if t:
            model.predict()
        update(t, points.ravel())
        evidence += model.log_likelihood
        means.append(model.x.copy())
        variances.append(model.P.copy())
    if smooth:
        return gaussian(clip, *model.rts_smoother(np.array(means), np.array(variances))[:2])
    return gaussian(clip, means, variances, evidence)


def kalman(clip: Clip, n: int, seed: int, smooth: bool = False) -> Answer:
    from filterpy.kalman import KalmanFilter

    d = len(clip.which)
    model = KalmanFilter(dim_x=d, dim_z=30)
    model.x, model.P = np.zeros(d), np.diag(clip.deviation**2)
    model.F, model.Q, model.R = clip.keep * np.eye(d), clip.change, clip.noise**2 * np.eye(30)
    model.H = clip.slopes(0, np.zeros(d))
    return followed(clip, model, smooth, lambda t, points: model.update(points - clip.seen(t, np.zeros((1, d)))[0]))


def unscented(clip: Clip, n: int, seed: int, smooth: bool = False) -> Answer:
    from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter

    d = len(clip.which)
    spread = MerweScaledSigmaPoints(d, alpha=0.5, beta=2.0, kappa=3.0 - d)
    model = UnscentedKalmanFilter(d, 30, 1 / FPS, hx=None, fx=lambda x, dt: clip.keep * x, points=spread)
    model.P, model.Q, model.R = np.diag(clip.deviation**2), clip.change, clip.noise**2 * np.eye(30)
    model.sigmas_f = spread.sigma_points(model.x, model.P)
    return followed(clip, model, smooth, lambda t, points: model.update(points, hx=lambda x: clip.seen(t, x[None])[0]))


def chopin(clip: Clip, n: int, seed: int, how: str) -> Answer:
    """The library `particles`; `how` is one of "bootstrap", "guided", "sqmc" and "ffbs"."""
    # Not declared in pyproject.toml, where it couldn't be resolved: it asks for NumPy 1.
    particles, distributions, state_space_models = (
        importlib.import_module(f"particles{name}") for name in ("", ".distributions", ".state_space_models")
    )
    change, precise = clip.change, np.linalg.inv(clip.change)

    class Model(state_space_models.StateSpaceModel):
        def PX0(self):
            return distributions.MvNormal(loc=np.zeros(len(clip.which)), cov=np.diag(clip.deviation**2))

        def PX(self, t, xp):
            return distributions.MvNormal(loc=clip.keep * xp, cov=change)

        def PY(self, t, xp, x):
            return distributions.MvNormal(loc=clip.seen(t, x), cov=clip.noise**2 * np.eye(30))

        def proposal0(self, data):
            return optimal(0, np.zeros((1, len(clip.which))), np.diag(clip.deviation**-2.0))

        def proposal(self, t, xp, data):
            return optimal(t, clip.keep * xp, precise)

    def optimal(t, expected, precision):
        slopes = clip.slopes(t, expected.mean(axis=0)) / clip.noise
        cov = np.linalg.inv(precision + slopes.T @ slopes)
        return distributions.MvNormal(
            loc=expected + (clip.points[t].ravel() - clip.seen(t, expected)) / clip.noise @ slopes @ cov, cov=cov
        )

    np.random.seed(seed)  # noqa: NPY002 the library knows no other generator
    data = [points.ravel() for points in clip.points]
    kind = state_space_models.GuidedPF if how == "guided" else state_space_models.Bootstrap
    run = particles.SMC(
        fk=kind(ssm=Model(), data=data), N=n, qmc=how == "sqmc", resampling="systematic", ESSrmin=0.5,
        store_history=True,
    )  # fmt: skip
    run.run()
    if how == "ffbs":
        paths = run.hist.backward_sampling_ON2(PATHS)
        return weighted(clip, paths, [np.full(PATHS, 1 / PATHS)] * len(paths))
    return weighted(clip, run.hist.X, [w.W for w in run.hist.wgts], run.logLt)


Method = Callable[[Clip, int, int], Answer]
FILTERS: dict[str, Method] = {
    "`filterpy` Kalman": kalman,
    "`filterpy` unscented": unscented,
    "`ParticleFilter`": ours,
    "`particles` bootstrap": lambda *of: chopin(*of, "bootstrap"),
    "`particles` guided": lambda *of: chopin(*of, "guided"),
    "`particles` SQMC": lambda *of: chopin(*of, "sqmc"),
}
SMOOTHERS: dict[str, Method] = {
    "`filterpy` Kalman, RTS": lambda *of: kalman(*of, smooth=True),
    "`filterpy` unscented, RTS": lambda *of: unscented(*of, smooth=True),
    "`particles` FFBS": lambda *of: chopin(*of, "ffbs"),
}


def reference(model: str, clip: Clip, n: int) -> float:
    """Log evidence of a clip."""
    if model == "place":
        return kalman(clip, n, 0).evidence
    many = [chopin(clip, MANY * n, 1000 + run, "guided").evidence for run in range(TIMES)]
    return float(np.logaddexp.reduce(many) - np.log(TIMES))


def row(name: str, method: Method, clips: list[Clip], exact: list[float], n: int, runs: int) -> str:
    """A method's line of the table."""
    errors, covered, off, spread, seconds = [], [], [], [], []
    for k, (one, evidence) in enumerate(zip(clips, exact, strict=True)):
        began = time.process_time()
        found = [method(one, n, 100 * k + run) for run in range(1 if "filterpy" in name else runs)]
        seconds.append((time.process_time() - began) / len(found))
        errors.append(np.mean([error(one, answer.means) for answer in found]))
        covered.append(np.mean([np.abs(answer.levels - 0.5) < 0.45 for answer in found]))
        off.append(np.mean([answer.evidence - evidence for answer in found]))
        spread.append(np.std([answer.evidence for answer in found], ddof=1) if len(found) > 1 else 0.0)
    cells = [cell(mean(errors), "{:.1f}"), cell(mean(covered), "{:.1%}")]
    cells += [cell(mean(off), "{:+.2f}"), f"{np.mean(spread):.2f}"] if np.isfinite(off).all() else ["–", "–"]
    return f"| {name} | {' | '.join(cells)} | {np.median(seconds):.2f} |"


def error(clip: Clip, means: np.ndarray) -> float:
    """Mean distance [mm] of markers from the truth's."""
    pairs = [(clip.joints(t, means[t : t + 1]), clip.joints(t, clip.truth[t : t + 1])) for t in range(len(means))]
    return 1e3 * float(np.mean([np.linalg.norm(a - b, axis=-1).mean() for a, b in pairs]))


def main() -> None:
    """Print a table for each model."""
    parser = Arguments(__doc__)
    parser.add_argument("--clips", type=int, default=10, quick=2)
    parser.add_argument("--runs", type=int, default=10, quick=2)
    parser.add_argument("--frames", type=int, default=FRAMES, quick=5)
    parser.add_argument("--particles", type=int, default=1024, quick=64)
    asked = parser.parse_args()
    needs("particles", "filterpy")
    for model in UNKNOWN:
        clips = [clip(model, seed, asked.frames) for seed in range(asked.clips)]
        exact = [reference(model, one, asked.particles) for one in clips]
        print(f"\n{model}, N = {asked.particles:,}:\n")
        print("| filter | error [mm] | coverage | log evidence off by | its deviation | s |\n|-|-|-|-|-|-|")
        for name, method in (FILTERS | SMOOTHERS).items():
            if model == "place" or "Kalman" not in name:
                print(row(name, method, clips, exact, asked.particles, asked.runs), flush=True)


if __name__ == "__main__":
    main()
