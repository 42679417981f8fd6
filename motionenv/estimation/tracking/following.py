"""Following somebody through a whole film, which may be looked at ahead and backwards: attempts, and the best of them.

An attempt starts where somebody begins to walk, follows to the film's end, and from the start back to its beginning.
Where the expected figure has lost the foreground, it starts anew. Outlines from the side hardly tell left from right;
two walkers who are mirror images of each other in their own plane of walking look the same, but for perspective. So
each attempt is made a second time from the mirrored start, and silhouettes and colours over the whole film choose.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from motionenv.body import mirror
from motionenv.errors import MotionError
from motionenv.estimation.observation import ObservationModel
from motionenv.estimation.tracking.choosing import advantage
from motionenv.estimation.tracking.filters import Belief, ParticleFilter
from motionenv.estimation.tracking.priors import Prior, Start, systematic
from motionenv.estimation.tracking.start import SPREAD, automatic_start
from motionenv.types import Camera, Skeleton

_START = 1.0  # [s] of the film that tell where the track begins
_WIDE = 6000  # hypotheses of each start
_CANDIDATES = 64  # poses of a belief with which the way back begins
_SHOWN = 30  # particles that are kept of each frame
_LOST, _PATIENCE = 0.35, 0.4  # overlap below which the figure has lost the person, and for how long [s] it may


@dataclass(frozen=True, eq=False)
class Followed:
    """One attempt.

    Attributes:
        poses: expected ones (T, 25).
        particles: (T, particles, 25), as likely as each other.
        effective: (T,) effective sample sizes.
        overlap: (T,) of the expected silhouette with the foreground: intersection over union.
        starts: by frame, from where it started, and started anew.
    """

    poses: np.ndarray
    particles: np.ndarray
    effective: np.ndarray
    overlap: np.ndarray
    starts: Mapping[int, Start]


@dataclass(frozen=True, eq=False)
class Follower:
    """Follows whoever is in the foregrounds of a film.

    Attributes:
        prior: of motion.
        back: the same for a film that runs backwards.
        likelihood: of masks.
        film: (T, height, width) probabilities of foreground.
        colours: (T, height, width) of `motionenv.estimation.appearance.colour_bins`.
        begin: frame to start at.
        particles: of the filter.
        layers: of annealing.
        rng: of all draws.
    """

    prior: Prior
    back: Prior
    likelihood: ObservationModel
    film: np.ndarray
    colours: np.ndarray
    begin: int
    particles: int
    layers: int
    rng: np.random.Generator

    def best(self, attempts: int, tick: Callable[[int], None]) -> Followed:
        """The attempt that shows the film best; every second one starts as the best so far, left and right exchanged.

        Args:
            attempts: how many.
            tick: called with the number of frames followed so far, of all attempts.
        """
        best: Followed | None = None
        for k in range(attempts):
            given = {} if best is None or k % 2 == 0 else {i: exchanged(s) for i, s in best.starts.items()}
            found = self._attempt(given, partial(_after, tick, k * len(self.film)))
            best = found if best is None or self._better(found, best) else best
        assert best is not None
        return best

    def _better(self, one: Followed, other: Followed) -> bool:
        return advantage(one.poses, other.poses, self.likelihood, self.film, self.colours) > 0

    def _attempt(self, given: Mapping[int, Start], tick: Callable[[int], None]) -> Followed:
        """Follow forwards from `begin`, and back from there."""
        record = _Record(len(self.film), self.likelihood, self.film, self.rng)
        tracker, starts, lost = self._tracker(self.prior), {}, 0
        for i in range(self.begin, len(self.film)):
            if i == self.begin or i in given or lost >= _PATIENCE * self.prior.fps:
                start = given[i] if i in given else self._start(i)
                lost = 0
                if start is not None:
                    starts[i] = start
                    tracker.start(start)
            belief = tracker.step(mask=self.film[i])
            lost = lost + 1 if record.keep(i, belief) < _LOST else 0
            tick(i - self.begin + 1)
            if i == self.begin:
                there = belief
        tracker = self._tracker(self.back)
        tracker.start(_from_here(there, self.rng))
        for i in range(self.begin - 1, -1, -1):
            record.keep(i, tracker.step(mask=self.film[i]))
            tick(len(self.film) - i)
        return Followed(record.poses, record.particles, record.effective, record.overlap, starts)

    def _tracker(self, prior: Prior) -> ParticleFilter:
        return ParticleFilter(prior, self.likelihood, self.particles, layers=self.layers, seed=self.rng)

    def _start(self, frame: int) -> Start | None:
        """Where somebody is in a frame and how he goes on; None where nobody is seen.

        Raises:
            MotionError: nobody is seen where the track is to begin.
        """
        looked = self.film[frame : frame + max(1, round(_START * self.prior.fps))]
        try:
            return automatic_start(
                self.likelihood, [{"mask": f} for f in looked], fps=self.prior.fps, n=_WIDE, seed=self.rng
            )
        except MotionError:
            if frame == self.begin:
                raise
            return None


def _after(tick: Callable[[int], None], done: int, more: int) -> None:
    tick(done + more)


class _Record:
    """What is kept of each frame's belief.

    Args:
        frames: how many.
        likelihood: knows body and camera.
        film: (T, height, width) probabilities of foreground.
        rng: of the draw of particles.
    """

    def __init__(self, frames: int, likelihood: ObservationModel, film: np.ndarray, rng: np.random.Generator):
        self.poses, self.particles = np.empty((frames, 25)), np.empty((frames, _SHOWN, 25))
        self.effective, self.overlap = np.empty(frames), np.empty(frames)
        self._likelihood, self._film, self._rng = likelihood, film, rng

    def keep(self, i: int, belief: Belief) -> float:
        """Keep the belief of frame `i`; returns the overlap."""
        self.poses[i], self.effective[i] = belief.mean, belief.effective
        self.particles[i] = belief.poses[systematic(np.exp(belief.log_weights), _SHOWN, self._rng)]
        self.overlap[i] = overlap(self.poses[i], self._likelihood.skeleton, self._likelihood.camera, self._film[i])
        return float(self.overlap[i])


def exchanged(start: Start) -> Start:
    """The mirror image of a start in the walker's own plane of walking: left limbs do what right ones did.

    Args:
        start: any.
    """
    return Start(_reflected(start.poses), start.log_weights, _reflected(start.previous), start.spread)


def overlap(pose: np.ndarray, skeleton: Skeleton, camera: Camera, foreground: np.ndarray) -> float:
    """Intersection over union of a pose's silhouette and a foreground (height, width).

    Args:
        pose: (25,) [m, rad].
        skeleton: the body.
        camera: whose picture it is.
        foreground: probabilities.
    """
    from motionenv.render import render

    body, seen = render(pose, skeleton, camera).limbs > 0, foreground > 0.5
    return float((body & seen).sum() / max((body | seen).sum(), 1))


def _reflected(poses: np.ndarray) -> np.ndarray:
    """Poses (n, 25) reflected, in the same place with the same heading."""
    other = mirror(poses)
    other[:, [1, 5]] = poses[:, [1, 5]]
    return other


def _from_here(belief: Belief, rng: np.random.Generator) -> Start:
    """A start at a belief; how it moved in the frame before isn't known."""
    poses = belief.poses[systematic(np.exp(belief.log_weights), _CANDIDATES, rng)]
    return Start(poses, np.zeros(len(poses)), np.full(poses.shape, np.nan), SPREAD)
