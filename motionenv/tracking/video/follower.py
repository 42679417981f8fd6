"""Follow a person whom detections guide through a video: start at the guide's pose, and start again after its gaps.

Where the guide knows the pose, particles stay about it; in its gaps the motion prior and silhouettes alone go on.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from motionenv.likelihoods.silhouette import SilhouetteLikelihood
from motionenv.tracking.initialization import SPREAD
from motionenv.tracking.particle_filter import Belief, ParticleFilter
from motionenv.tracking.priors.base import Prior, Start, systematic
from motionenv.tracking.priors.fpca import FPCAPrior
from motionenv.tracking.priors.guided import GuidedPrior
from motionenv.tracking.video.guide import DEVIATION, Guide
from motionenv.tracking.video.survey import Look
from motionenv.types import Camera, Skeleton

_SHOWN = 30  # particles kept of each frame


class Followed:
    """A track of so many `frames`.

    Attributes:
        poses: expected poses (T, 25).
        particles: (T, particles, 25), equally weighted.
        effective: (T,) effective sample sizes.
        overlap: (T,) of the expected silhouette and the foreground, over the silhouette alone where `Look.merged`.
    """

    def __init__(self, frames: int) -> None:
        self.poses, self.particles = np.empty((frames, 25)), np.empty((frames, _SHOWN, 25))
        self.effective, self.overlap = np.empty(frames), np.empty(frames)


@dataclass(frozen=True, eq=False)
class Follower:
    """Follows a person in the foregrounds of a video.

    Attributes:
        prior: of the motion.
        likelihood: of masks.
        seen: what the film shows of the person.
        guide: what detections tell; it knows the first frame's pose.
        particles, layers, rng: of the filter.
        smooth: whether frames are told by all of their track.
    """

    prior: Prior
    likelihood: SilhouetteLikelihood
    seen: Look
    guide: Guide
    particles: int
    layers: int
    rng: np.random.Generator
    smooth: bool = False

    def followed(self, tick: Callable[[int], None]) -> Followed:
        """The track; `tick` is called with the number of frames processed so far."""
        film, known = self.seen.foreground, self.guide.known
        made = Followed(len(film))
        tracks: list[tuple[ParticleFilter, list[int]]] = []  # and the frames that each has followed
        for i in range(len(film)):
            if i == 0 or known[i] != known[i - 1]:
                tracks.append((self._tracker(i), []))
            tracks[-1][1].append(i)
            self._keep(made, i, tracks[-1][0].step(mask=film[i]))
            tick(i + 1)
        for tracker, frames in tracks:
            for i, belief in zip(frames, tracker.smoothed() if tracker.keep else [], strict=False):
                self._keep(made, i, belief)
        return made

    def _tracker(self, frame: int) -> ParticleFilter:
        """A filter that starts at the guide's pose, or goes on where the guide led."""
        poses = self.guide.poses
        prior = self.prior
        if self.guide.known[frame]:
            prior = GuidedPrior(poses, DEVIATION, skeleton=prior.skeleton, fps=prior.fps, first=frame)
            start = Start.at(poses[frame], spread=DEVIATION)
        else:
            last, before = poses[frame - 1], poses[max(frame - 2, 0)]
            before = before if np.isfinite(before).all() else last
            start = Start.at(2 * last - before, last, SPREAD)
        keep = self.smooth and isinstance(prior, FPCAPrior)
        tracker = ParticleFilter(prior, self.likelihood, self.particles, layers=self.layers, keep=keep, seed=self.rng)
        tracker.start(start)
        return tracker

    def _keep(self, made: Followed, i: int, belief: Belief) -> None:
        """Store the posterior of frame `i`."""
        made.poses[i], made.effective[i] = belief.mean, belief.effective
        made.particles[i] = belief.poses[systematic(np.exp(belief.log_weights), _SHOWN, self.rng)]
        body, camera = self.likelihood.skeleton, self.likelihood.camera
        either, own = overlap(made.poses[i], body, camera, self.seen.foreground[i])
        made.overlap[i] = own if self.seen.merged[i] else either


def overlap(pose: np.ndarray, skeleton: Skeleton, camera: Camera, foreground: np.ndarray) -> tuple[float, float]:
    """Intersection of a pose's silhouette and a foreground, over their union and over the silhouette alone.

    `pose` (25,) [m, rad] is of a `skeleton`; the `camera` is that of `foreground` (height, width), probabilities.
    """
    from motionenv.render import render

    body, seen = render(pose, skeleton, camera).limbs > 0, foreground > 0.5
    both = (body & seen).sum()
    return float(both / max((body | seen).sum(), 1)), float(both / max(body.sum(), 1))
