"""Track a person in a real video, without ground truth: `track_video`.

    video → detections → whom to follow → camera (if unknown) → lifted motion, which guides → filter → verdict

The camera must be static. Poses are NaN where the person isn't wholly in the picture, and where the track is lost.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from motionenv._core.precompilation import precompile
from motionenv._core.validation import checked_number, checked_whole, random_generator
from motionenv.body import from_height
from motionenv.errors import MotionError
from motionenv.likelihoods.silhouette import SilhouetteLikelihood
from motionenv.tracking.particle_filter import check_filter
from motionenv.tracking.priors.base import Prior
from motionenv.tracking.priors.fpca import FPCAPrior
from motionenv.tracking.video.candidates import Candidate, chosen
from motionenv.tracking.video.detection import resized, side_camera, span, standing_height
from motionenv.tracking.video.follower import Follower
from motionenv.tracking.video.guide import Guide, disagreement, lifted
from motionenv.tracking.video.survey import Film, Look, Survey, check_area, look, survey
from motionenv.tracking.video.verdict import ABSENT, FOLLOWED, Lost, losses, verdict
from motionenv.types import Camera, Motion, Points, Skeleton

_USUAL = 1.75  # [m] default body height
_MISSES, _ALARMS = 0.25, 0.1  # miss and false-alarm rates: the foreground of videos has holes and clutter
#: Makes a prior for a body and a frame rate.
MakePrior = Callable[[Skeleton, float], Prior]


@dataclass(frozen=True, eq=False)
class VideoTrack:
    """Result of `track_video`.

    Attributes:
        motion: expected poses (T, 25) at the video's frames; NaN where the person isn't tracked.
        particles: (T, 30, 25), drawn from the filter's particles by their weights; NaN as above.
        effective: (T,) effective sample sizes.
        overlap: (T,) intersection over union of the expected silhouette and the person's outline, from 0 to 1, also in
            lost frames; over the silhouette alone where the outline is one with somebody else's.
        expected: (T, 25) expected poses, also in lost frames.
        camera: given or guessed, for the video's own image size.
        guessed: whether the camera is a guess; lengths are then relative to the assumed height.
        reasons: (T,) why a frame isn't followed, numbers of `motionenv.tracking.video.verdict.REASONS`.
        person: who was followed.
    """

    motion: Motion
    particles: np.ndarray
    effective: np.ndarray
    overlap: np.ndarray
    expected: np.ndarray
    camera: Camera
    guessed: bool
    reasons: np.ndarray
    person: Candidate

    def __repr__(self) -> str:
        return f"VideoTrack({self.followed.sum()} of {len(self.reasons)} frames followed, {self.motion.fps:g} fps)"

    @property
    def followed(self) -> np.ndarray:
        """(T,) whether a frame has a pose: the person is followed."""
        return self.reasons == FOLLOWED

    @property
    def losses(self) -> list[Lost]:
        """The times in which the person isn't followed, and why."""
        return losses(self.reasons)

    @property
    def lost(self) -> bool:
        """Whether the person was lost at any time in the picture."""
        return any(not loss.left for loss in self.losses)


def track_video(
    film: Film | str | Path, camera: Camera | None = None, *, height: float | None = None, person: int | None = None,
    box: Sequence[float] | None = None, point: Sequence[float] | None = None, at: float | None = None,
    prior: MakePrior | None = None, particles: int = 2000, layers: int = 2, smooth: bool = False,
    seed: int | np.random.Generator | None = None, threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> VideoTrack:  # fmt: skip
    """Track a person in a film.

    Args:
        film: a `Film`, or the path of a video.
        camera: static camera of the film, with the ground at z = 0; None guesses a camera at the side.
        height: body height [m]; None takes that which the detected points tell.
        person: number of whom to follow in `find_people`; None, without `box` and `point`, is the best seen.
        box: (x, y, width, height) [pixels of the film] around whom to follow, in some frame.
        point: (x, y) [pixels of the film] on whom to follow, in some frame.
        at: moment of `box` or `point` [s]; None is any.
        prior: makes the prior of a body and a rate; None uses the `FPCAPrior`.
        particles: number of particles of the filter.
        layers: annealing layers.
        smooth: whether all frames tell the pose in each, not only those before it: `ParticleFilter.smoothed`. Where
            detections lead, it changes nothing.
        seed: int or Generator.
        threads: threads of the likelihood, which don't change the result; None uses one per core.
        progress: called with the number of frames processed and the total.

    Raises:
        FormatError: not a video, or a damaged one.
        MotionError: nobody is seen, a moving camera, a known camera that contradicts the picture, no detector, or an
            argument out of range.
    """
    check_filter(particles, layers=layers)
    _check_choice(person, box, point, at)
    precompile("film")
    skeleton, rng = from_height(_USUAL if height is None else height), random_generator(seed)
    seen = survey(film if isinstance(film, Film) else Film(film))
    who, size = chosen(seen.found, person=person, box=box, point=point, at=at), (seen.info.width, seen.info.height)
    frames = slice(*span(who.boxes, size[0]))
    whole = side_camera(who.boxes[frames], skeleton, *size) if camera is None else resized(camera, *size)
    if camera is not None and height is None:
        standing_height(who.boxes[frames], whole)  # refuses cameras that can't be
    guide, frames = _guide(who.points, whole, seen, height, frames)
    close = look(seen, who, frames, whole)
    made = FPCAPrior(skeleton=guide.skeleton, fps=seen.fps) if prior is None else prior(guide.skeleton, seen.fps)
    likelihood = _likelihood(close, made.skeleton, threads)
    total = len(close.foreground)
    found = Follower(made, likelihood, close, guide, particles, layers, rng, smooth).followed(
        lambda done: None if progress is None else progress(done, total)
    )
    reasons = np.full(seen.frames, ABSENT)
    off = disagreement(found.poses, guide, whole)
    reasons[frames] = verdict(found.poses, found.overlap, who.seen[frames], seen.fps, off)
    held, present = reasons == FOLLOWED, reasons != ABSENT
    return VideoTrack(
        motion=Motion(_spread(found.poses, held, frames), guide.skeleton, seen.fps, f"{seen.film.path}"),
        particles=_spread(found.particles, held, frames), effective=_spread(found.effective, held, frames),
        overlap=_spread(found.overlap, present, frames), expected=_spread(found.poses, present, frames), camera=whole,
        guessed=camera is None, reasons=reasons, person=who,
    )  # fmt: skip


def find_people(film: Film | str | Path) -> list[Candidate]:
    """Whom the detections of a `film` show, best seen first; `track_video` takes the number as `person`.

    Raises:
        FormatError: not a video, a damaged one, or one that shows nobody.
        MotionError: the camera moves, no detector, or an argument out of range.
    """
    return survey(film if isinstance(film, Film) else Film(film)).found


def _check_choice(person, box, point, at) -> None:
    given = [name for name, value in (("person", person), ("box", box), ("point", point)) if value is not None]
    if len(given) > 1:
        raise MotionError(f"give only one of person, box and point; got {' and '.join(given)}")
    if at is not None and box is None and point is None:
        raise MotionError("at is the moment of a box or point: give one of them")
    if person is not None:
        checked_whole(person, "person", 1)
    if at is not None:
        checked_number(at, "at", 0)
    check_area("box", box, "x, y, width, height")
    check_area("point", point, "x, y")


def _guide(points: Points, camera: Camera, seen: Survey, height: float | None, frames: slice) -> tuple[Guide, slice]:
    """What a person's points tell, and those of the frames from the first to the last pose that they do."""
    guide = lifted(points, camera, seen, height, frames)
    known = np.flatnonzero(guide.known)
    if not len(known):
        raise MotionError(f"the detected points in frames {frames.start} to {frames.stop - 1} tell no pose")
    inner = slice(known[0], known[-1] + 1)
    guide = replace(guide, poses=guide.poses[inner], points=guide.points[inner])
    return guide, slice(frames.start + inner.start, frames.start + inner.stop)


def _likelihood(close: Look, skeleton: Skeleton, threads: int | None) -> SilhouetteLikelihood:
    focal = np.sqrt(abs(np.linalg.det(close.camera.K[:2, :2])))
    far = float(focal * skeleton.height / np.nanmedian(close.boxes[:, 3] - close.boxes[:, 2]))
    return SilhouetteLikelihood(
        close.camera, skeleton, misses=_MISSES, false_alarms=_ALARMS, distance=far, threads=threads
    )


def _spread(part: np.ndarray, where: np.ndarray, frames: slice) -> np.ndarray:
    """Values of some frames in an array of all frames (T, ...); NaN except `where` (T,)."""
    whole = np.full((len(where), *part.shape[1:]), np.nan)
    whole[frames] = part
    whole[~where] = np.nan
    return whole
