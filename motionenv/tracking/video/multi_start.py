"""Track a video several times from different starts, and keep the best track.

A track starts where the person begins to walk, continues to the end, and then backwards from the start to the
beginning. Where the expected body loses the foreground, it restarts. Outlines from the side hardly distinguish left
from right: apart from perspective, a walker and the mirror image in the sagittal plane look the same. Each track is
therefore repeated from the mirrored start, and silhouettes and colours over the whole video select the better one.

A walker and the mirror image differ in which leg is nearer: it occludes the other shoe, and the near hand is seen in
front of the trousers. Each kind of limb (left and right dressed alike) gets a colour histogram, learned from pixels at
which both tracks see that kind of limb. A pixel contributes

    log-odds = log[(1 - outliers) p(colour | limb) / p(colour | body) + outliers]

relative to the colours of the whole body, because silhouettes already account for the background. The evidence of the
filters is not used: a posterior that is undecided between left and right has higher evidence than a wrong one, and
about that of a correct one, although its mean is a meaningless pose.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from motionenv.body import LIMBS, mirror
from motionenv.errors import MotionError
from motionenv.likelihoods.silhouette import SilhouetteLikelihood
from motionenv.tracking.initialization import SPREAD, automatic_start
from motionenv.tracking.particle_filter import Belief, ParticleFilter
from motionenv.tracking.priors.base import Prior, Start, systematic
from motionenv.tracking.priors.fpca import FPCAPrior
from motionenv.tracking.priors.guided import GuidedPrior
from motionenv.tracking.video.guide import DEVIATION, Guide
from motionenv.tracking.video.survey import COLOURS, Look
from motionenv.types import Camera, Skeleton

_START = 1.0  # [s] duration of the images used for initialisation
_WIDE = 6000  # hypotheses of each initialisation
_CANDIDATES = 64  # poses of the posterior from which backward tracking starts
_SHOWN = 30  # particles kept of each frame
_LOST, _PATIENCE = 0.35, 0.4  # the track is lost if the overlap stays below _LOST for _PATIENCE seconds
_EFFECTIVE = 25.0  # effective number of independent pixels of a body in each frame
_OUTLIERS = 0.2  # fraction of a limb's pixels with other body colours
_POOL = 20.0  # pseudo-count [pixels] that shrinks a limb's histogram towards the body's
_KINDS = sorted({limb.removeprefix("left_").removeprefix("right_") for limb in LIMBS})
#: Kind of limb, from 1, by limb number in a label image; 0 is none.
_KIND = np.array([0, *(1 + _KINDS.index(limb.removeprefix("left_").removeprefix("right_")) for limb in LIMBS)])


class Attempt:
    """One track of a video of so many `frames`.

    Attributes:
        poses: expected poses (T, 25).
        particles: (T, particles, 25), equally weighted.
        effective: (T,) effective sample sizes.
        overlap: (T,) of the expected silhouette and the foreground, over the silhouette alone where `merged`.
        starts: start and restarts, by frame.
    """

    def __init__(self, frames: int) -> None:
        self.poses, self.particles = np.empty((frames, 25)), np.empty((frames, _SHOWN, 25))
        self.effective, self.overlap = np.empty(frames), np.empty(frames)
        self.starts: dict[int, Start] = {}


@dataclass(frozen=True, eq=False)
class MultiStart:
    """Tracks the person in the foregrounds of a video.

    Attributes:
        prior, back: motion prior, and the same for reversed time.
        likelihood: of masks.
        seen: what the film shows of the person.
        begin: frame to start at.
        particles, layers, rng: of the filter.
        guide: what detections tell, from `begin` on; None if there are none.
        smooth: whether frames are told by all of their track.
    """

    prior: Prior
    back: Prior
    likelihood: SilhouetteLikelihood
    seen: Look
    begin: int
    particles: int
    layers: int
    rng: np.random.Generator
    guide: Guide | None = None
    smooth: bool = False

    def best(self, attempts: int, tick: Callable[[int], None]) -> Attempt:
        """The best of several `attempts`; every second one starts from the mirror image of the best so far.

        `tick` is called with the number of frames processed so far, over all of them.
        """
        best: Attempt | None = None
        for k in range(attempts):
            given = {} if best is None or k % 2 == 0 else {i: exchanged(s) for i, s in best.starts.items()}
            found = self._attempt(given, tick, k * len(self.seen.foreground))
            if best is None or advantage(found.poses, best.poses, self.likelihood, self.seen) > 0:
                best = found
        assert best is not None
        return best

    def _attempt(self, given: Mapping[int, Start], tick: Callable[[int], None], done: int) -> Attempt:
        """Track forwards from `begin`, and backwards from there, after `done` frames of other attempts."""
        film, lost = self.seen.foreground, 0
        made = Attempt(len(film))
        tracks: list[tuple[ParticleFilter, list[int]]] = []  # and the frames that each has followed, in their order
        guided = np.zeros(len(film), dtype=bool) if self.guide is None else self.guide.known
        for i in range(self.begin, len(film)):
            begins = i == self.begin or guided[i] != guided[i - 1]
            if begins or i in given or lost >= _PATIENCE * self.prior.fps:
                start = given[i] if i in given else self._start(i)
                lost = 0
                if start is not None:
                    made.starts[i] = start
                    tracks.append((self._tracker(start, self._prior(i)), []))
            tracks[-1][1].append(i)
            belief = tracks[-1][0].step(mask=film[i])
            lost = lost + 1 if self._keep(made, i, belief) < _LOST else 0
            tick(done + i - self.begin + 1)
            if i == self.begin:
                there = belief
        here = there.poses[systematic(np.exp(there.log_weights), _CANDIDATES, self.rng)]
        unknown = np.full(here.shape, np.nan)
        tracker = self._tracker(Start(here, np.zeros(len(here)), unknown, SPREAD), self.back)
        tracks.append((tracker, [*range(self.begin - 1, -1, -1)]))
        for i in range(self.begin - 1, -1, -1):
            self._keep(made, i, tracker.step(mask=film[i]))
            tick(done + len(film) - i)
        for tracker, frames in tracks:
            for i, belief in zip(frames, tracker.smoothed() if tracker.keep and frames else [], strict=False):
                self._keep(made, i, belief)
        return made

    def _keep(self, made: Attempt, i: int, belief: Belief) -> float:
        """Store the posterior of frame `i`; returns its intersection over union with the foreground."""
        made.poses[i], made.effective[i] = belief.mean, belief.effective
        made.particles[i] = belief.poses[systematic(np.exp(belief.log_weights), _SHOWN, self.rng)]
        body, camera = self.likelihood.skeleton, self.likelihood.camera
        either, own = overlap(made.poses[i], body, camera, self.seen.foreground[i])
        made.overlap[i] = own if self.seen.merged[i] else either
        return either

    def _tracker(self, start: Start, prior: Prior) -> ParticleFilter:
        keep = self.smooth and isinstance(prior, FPCAPrior)
        tracker = ParticleFilter(prior, self.likelihood, self.particles, layers=self.layers, keep=keep, seed=self.rng)
        tracker.start(start)
        return tracker

    def _prior(self, frame: int) -> Prior:
        if self.guide is None or not self.guide.known[frame]:
            return self.prior
        return GuidedPrior(self.guide.poses, DEVIATION, skeleton=self.prior.skeleton, fps=self.prior.fps, first=frame)

    def _start(self, frame: int) -> Start | None:
        """Start at the guide's pose or where it leads, or initialise; None if no person is found."""
        if self.guide is not None and self.guide.known[frame]:
            return Start.at(self.guide.poses[frame], spread=DEVIATION)
        if self.guide is not None and frame > 1 and self.guide.known[frame - 2 : frame].all():
            before, last = self.guide.poses[frame - 2 : frame]
            return Start.at(2 * last - before, last, SPREAD)
        looked = self.seen.foreground[frame : frame + max(1, round(_START * self.prior.fps))]
        try:
            return automatic_start(
                self.likelihood, [{"mask": f} for f in looked], fps=self.prior.fps, n=_WIDE, seed=self.rng
            )
        except MotionError:
            if frame == self.begin:
                raise
            return None


def advantage(one: np.ndarray, other: np.ndarray, likelihood: SilhouetteLikelihood, seen: Look) -> float:
    """Log-odds in favour of one track of a video over another.

    Args:
        one, other: expected poses (T, 25) [m, rad] of the tracks.
        likelihood: of masks.
        seen: what the film shows of the person.
    """
    from motionenv.render.raycast.engine import Raycaster

    raycaster, cells = Raycaster(), (1 + len(_KINDS)) * COLOURS
    agreed, shown, silhouettes = np.zeros(cells), np.zeros((2, cells)), np.zeros(2)
    for poses, foreground, colour in zip(np.stack([one, other], axis=1), seen.foreground, seen.colours, strict=True):
        likelihood.observe(mask=foreground)
        silhouettes += likelihood.log_likelihood(poses)
        limbs = raycaster.render(poses, likelihood.skeleton, likelihood.camera, rgb=False).limbs
        kinds = _KIND[np.asarray(limbs)]
        body, cell = (kinds > 0) & (foreground > 0.5), kinds * COLOURS + colour
        agreed += np.bincount(cell[0][body[0] & (kinds[0] == kinds[1])], minlength=cells)
        shown += [np.bincount(cell[i][body[i]], minlength=cells) for i in range(2)]
    each = (shown * _log_odds(agreed)).sum(axis=1) / np.maximum(shown.sum(axis=1), 1.0)
    first, second = silhouettes + _EFFECTIVE * len(seen.foreground) * each
    return float(first - second)


def _log_odds(counts: np.ndarray) -> np.ndarray:
    """Log-odds (cells,) of each kind of limb's colours against the whole body's, from pixel counts (cells,)."""
    limbs = counts.reshape(-1, COLOURS)
    body = limbs.sum(axis=0) + 1 / COLOURS
    body /= body.sum()
    limbs = (limbs + _POOL * body) / (limbs.sum(axis=1, keepdims=True) + _POOL)
    return np.log((1 - _OUTLIERS) * limbs / body + _OUTLIERS).ravel()


def exchanged(start: Start) -> Start:
    """Mirror a `start` in the walker's sagittal plane: left and right limbs swap roles."""
    return Start(_reflected(start.poses), start.log_weights, _reflected(start.previous), start.spread, start.heights)


def overlap(pose: np.ndarray, skeleton: Skeleton, camera: Camera, foreground: np.ndarray) -> tuple[float, float]:
    """Intersection of a pose's silhouette and a foreground, over their union and over the silhouette alone.

    `pose` (25,) [m, rad] is of a `skeleton`; the `camera` is that of `foreground` (height, width), probabilities.
    """
    from motionenv.render import render

    body, seen = render(pose, skeleton, camera).limbs > 0, foreground > 0.5
    both = (body & seen).sum()
    return float(both / max((body | seen).sum(), 1)), float(both / max(body.sum(), 1))


def _reflected(poses: np.ndarray) -> np.ndarray:
    """Poses (n, 25) reflected in the sagittal plane, with the same position and heading."""
    other = mirror(poses)
    other[:, [1, 5]] = poses[:, [1, 5]]
    return other
