"""Track a person in a real video, without ground truth: `track_video`.

    video → who moves → whom to follow → camera (if unknown) → start → filter, forwards and backwards → verdict

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
from motionenv.tracking.video.detection import departure_frame, resized, side_camera, span, standing_height
from motionenv.tracking.video.guide import Guide, detected, disagreement, lifted, people_of
from motionenv.tracking.video.multi_start import MultiStart
from motionenv.tracking.video.survey import Film, Look, Survey, check_area, look, survey
from motionenv.tracking.video.verdict import ABSENT, FOLLOWED, Lost, losses, verdict
from motionenv.types import Camera, Motion, Skeleton

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
        person: who was followed, and what speaks for a walking person.
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
    prior: MakePrior | None = None, particles: int = 2000, layers: int = 2, attempts: int = 4, smooth: bool = False,
    seed: int | np.random.Generator | None = None, threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> VideoTrack:  # fmt: skip
    """Track a person in a film.

    Args:
        film: a `Film`, or the path of a video.
        camera: static camera of the film, with the ground at z = 0; None guesses a camera at the side.
        height: body height [m]; None estimates it if the camera is known, and assumes 1.75 m otherwise.
        person: number of whom to follow in `find_people`; None, without `box` and `point`, is the likeliest walker.
        box: (x, y, width, height) [pixels of the film] around whom to follow, in some frame.
        point: (x, y) [pixels of the film] on whom to follow, in some frame.
        at: moment of `box` or `point` [s]; None is any.
        prior: makes the prior of a body and a rate; None uses the `FPCAPrior`.
        particles: number of particles of the filter.
        layers: annealing layers.
        attempts: number of tracks of the whole film, of which the best is returned. Every second one starts from a
            mirror image, see `motionenv.tracking.video.multi_start`. With detections, which tell the sides, 1 is enough
            and more aren't made.
        smooth: whether all frames tell the pose in each, not only those before it: `ParticleFilter.smoothed`. Where
            detections lead, it changes nothing.
        seed: int or Generator.
        threads: threads of the likelihood, which don't change the result; None uses one per core.
        progress: called with the number of frames processed and the total.

    Raises:
        FormatError: not a video, or a damaged one.
        MotionError: nobody walks, a moving camera, a known camera that contradicts the picture, or an argument out of
            range.
    """
    attempts = checked_whole(attempts, "attempts", 1)
    check_filter(particles, layers=layers)
    _check_choice(person, box, point, at)
    precompile("film")
    skeleton, rng = from_height(_USUAL if height is None else height), random_generator(seed)
    seen = _surveyed(film)
    who, size = chosen(seen.found, person=person, box=box, point=point, at=at), (seen.info.width, seen.info.height)
    frames = slice(*span(who.boxes, size[0]))
    whole = side_camera(who.boxes[frames], skeleton, *size) if camera is None else resized(camera, *size)
    guide = None if who.points is None else lifted(who.points, whole, seen, height, frames)
    if guide is not None:
        skeleton, attempts = guide.skeleton, 1
    elif camera is not None and height is None:
        skeleton = from_height(standing_height(who.boxes[frames], whole))
    close = look(seen, who, frames, whole)
    made = FPCAPrior(skeleton=skeleton, fps=seen.fps) if prior is None else prior(skeleton, seen.fps)
    follower = _follower(close, made, guide, particles, layers, smooth, threads, rng)
    total = attempts * len(close.foreground)
    best = follower.best(attempts, lambda done: None if progress is None else progress(done, total))
    reasons = np.full(len(seen.labels), ABSENT)
    off = None if guide is None else disagreement(best.poses, guide, whole)
    reasons[frames] = verdict(best.poses, best.overlap, who.mover.seen[frames], seen.fps, off)
    held, present = reasons == FOLLOWED, reasons != ABSENT
    return VideoTrack(
        motion=Motion(_spread(best.poses, held, frames), skeleton, seen.fps, f"{seen.film.path}"),
        particles=_spread(best.particles, held, frames), effective=_spread(best.effective, held, frames),
        overlap=_spread(best.overlap, present, frames), expected=_spread(best.poses, present, frames), camera=whole,
        guessed=camera is None, reasons=reasons, person=who,
    )  # fmt: skip


def find_people(film: Film | str | Path) -> list[Candidate]:
    """What moves in a `film`, or whom its detections show, the likeliest walking person first.

    `track_video` takes the number as `person`.

    Raises:
        FormatError: not a video, or a damaged one.
        MotionError: the camera moves, or an argument out of range.
    """
    return _surveyed(film).found


def _surveyed(film: Film | str | Path) -> Survey:
    """The first look at a film; its detections, if there are any, say who is in it."""
    seen = survey(film if isinstance(film, Film) else Film(film))
    return seen if seen.film.detections is None else replace(seen, found=detected(people_of(seen), seen))


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


def _follower(
    close: Look, prior: Prior, guide: Guide | None, particles: int, layers: int, smooth: bool, threads, rng
) -> MultiStart:
    skeleton, camera, boxes = prior.skeleton, close.camera, close.boxes
    focal = np.sqrt(abs(np.linalg.det(camera.K[:2, :2])))
    far = float(focal * skeleton.height / np.nanmedian(boxes[:, 3] - boxes[:, 2]))
    likelihood = SilhouetteLikelihood(
        camera, skeleton, misses=_MISSES, false_alarms=_ALARMS, distance=far, threads=threads
    )
    back: Prior = FPCAPrior(skeleton=skeleton, fps=prior.fps, backwards=True)
    if guide is not None and guide.known.any():
        begin = int(np.argmax(guide.known))
    else:
        alone = np.where(close.merged[:, None], np.nan, boxes)
        begin = departure_frame(alone if np.isfinite(alone).any() else boxes, prior.fps)
    return MultiStart(prior, back, likelihood, close, begin, particles, layers, rng, guide, smooth)


def _spread(part: np.ndarray, where: np.ndarray, frames: slice) -> np.ndarray:
    """Values of some frames in an array of all frames (T, ...); NaN except `where` (T,)."""
    whole = np.full((len(where), *part.shape[1:]), np.nan)
    whole[frames] = part
    whole[~where] = np.nan
    return whole
