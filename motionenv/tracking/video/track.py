"""Track a person in a real video, without ground truth: `track_video`.

    video → who moves → whom to follow → camera (if unknown) → start → filter, forwards and backwards → verdict

The camera must be static. Poses are NaN where the person isn't wholly in the picture, and where the track is lost.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

import numpy as np

from motionenv._core.precompilation import precompile
from motionenv._core.validation import checked_fps, checked_number, checked_whole, random_generator
from motionenv.body import from_height
from motionenv.errors import MotionError
from motionenv.likelihoods.silhouette import SilhouetteLikelihood
from motionenv.tracking.particle_filter import check_options
from motionenv.tracking.priors.base import Prior
from motionenv.tracking.priors.fpca import FPCAPrior
from motionenv.tracking.priors.mixture import MixturePrior
from motionenv.tracking.priors.velocity import VelocityPrior
from motionenv.tracking.video.candidates import Candidate, chosen
from motionenv.tracking.video.detection import departure_frame, resized, side_camera, span, standing_height
from motionenv.tracking.video.guide import detected, disagreement, lifted, people_of
from motionenv.tracking.video.multi_start import MultiStart
from motionenv.tracking.video.survey import Look, Survey, look, survey
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
    path: str | Path,
    camera: Camera | None = None,
    *,
    height: float | None = None,
    prior: MakePrior | None = None,
    particles: int = 2000,
    layers: int = 2,
    attempts: int = 4,
    fps: float | None = None,
    seconds: float = 60.0,
    background: np.ndarray | None = None,
    person: int | None = None,
    box: Sequence[float] | None = None,
    point: Sequence[float] | None = None,
    at: float | None = None,
    region: Sequence[float] | None = None,
    detections: str | PathLike | Points | Sequence[Points] | None = None,
    seed: int | np.random.Generator | None = None,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> VideoTrack:
    """Track the person in a video.

    Args:
        path: of the video, in any format that ffmpeg reads.
        camera: static camera of the video, with the ground at z = 0; None guesses a camera at the side.
        height: body height [m]; None estimates it if the camera is known, and assumes 1.75 m otherwise.
        prior: makes the prior of a body and a rate; None uses the `FPCAPrior`.
        particles: number of particles of the filter.
        layers: annealing layers.
        attempts: number of tracks of the whole video, of which the best is returned. Every second one starts from a
            mirror image, see `motionenv.tracking.video.multi_start`. With detections, which tell the sides, 1 is enough
            and more aren't made.
        fps: frame rate to track at [Hz], by nearest frames; None uses the video's own rate divided by the smallest
            whole number that gives at most 31.
        seconds: most seconds of the video to use.
        background: video, or at least three images uint8 (T, h, w, 3) with the video's aspect ratio, of the same view
            without the person. None estimates it from the video, correctly where the person stands in fewer than half
            of the frames.
        person: number of whom to follow in `find_people`; None, without `box` and `point`, is the likeliest walker.
        box: (x, y, width, height) [pixels of the film] around whom to follow, in some frame.
        point: (x, y) [pixels of the film] on whom to follow, in some frame.
        at: moment of `box` or `point` [s]; None is any.
        region: (x, y, width, height) [pixels of the film] outside of which nothing is looked at.
        detections: 2D keypoints of everybody in the film, with a frame for each of the film's: a detector's file or
            folder as of `motionenv.read_points`, or Points in the film's pixels, one for each person. They choose whom
            to follow, best and largest seen first, and which side is left; the motion lifted from them guides the
            tracker (`motionenv.tracking.video.guide`). Where they end, silhouettes go on.
        seed: int or Generator.
        threads: threads of the likelihood, which don't change the result; None uses one per core.
        progress: called with the number of frames processed and the total.

    Raises:
        FormatError: not a video, or a damaged one.
        MotionError: nobody walks, a moving camera, a known camera that contradicts the picture, or an argument out of
            range.
    """
    attempts = checked_whole(attempts, "attempts", 1)
    checked_number(seconds, "seconds", above=0)
    check_options(particles, layers=layers)
    _check_choice(person, box, point, at, region)
    fps = None if fps is None else checked_fps(fps)
    precompile("film")
    skeleton, rng = from_height(_USUAL if height is None else height), random_generator(seed)
    seen = _surveyed(path, detections, fps=fps, seconds=seconds, background=background, region=region)
    who, size = chosen(seen.found, person=person, box=box, point=point, at=at), (seen.info.width, seen.info.height)
    first, last = span(who.boxes, size[0])
    full = side_camera(who.boxes[first:last], skeleton, *size) if camera is None else resized(camera, *size)
    guide = None if who.points is None else lifted(who.points, full, seen, height, first, last)
    if guide is not None:
        skeleton, attempts = guide.skeleton, 1
    elif camera is not None and height is None:
        skeleton = from_height(standing_height(who.boxes[first:last], full))
    close = look(seen, who, first, last)
    made = FPCAPrior(skeleton=skeleton, fps=seen.fps) if prior is None else prior(skeleton, seen.fps)
    follower = _follower(close, who, (first, last), full, made, (particles, layers, threads), rng, guide)
    total = attempts * (last - first)
    best = follower.best(attempts, lambda done: None if progress is None else progress(done, total))
    reasons = np.full(len(seen.labels), ABSENT)
    outlined = who.mover.seen[first:last]
    off = None if guide is None else disagreement(best.poses, guide, full)
    reasons[first:last] = verdict(best.poses, best.overlap, outlined, seen.fps, off)
    held = reasons == FOLLOWED
    poses, shown, effective = (_spread(x, held, first) for x in (best.poses, best.particles, best.effective))
    overlap, expected = (_spread(x, reasons != ABSENT, first) for x in (best.overlap, best.poses))
    motion = Motion(poses, skeleton, seen.fps, f"{path}")
    return VideoTrack(motion, shown, effective, overlap, expected, full, camera is None, reasons, who)


def find_people(
    path: str | Path,
    *,
    fps: float | None = None,
    seconds: float = 60.0,
    background: np.ndarray | None = None,
    region: Sequence[float] | None = None,
    detections: str | PathLike | Points | Sequence[Points] | None = None,
) -> list[Candidate]:
    """What moves in a video, the likeliest walking person first; `track_video` takes the number as `person`.

    path, fps, seconds, background, region and detections are as of `track_video`; with detections, it's whom they show.

    Raises:
        FormatError: not a video, or a damaged one.
        MotionError: the camera moves, or an argument out of range.
    """
    checked_number(seconds, "seconds", above=0)
    _check_choice(None, None, None, None, region)
    fps = None if fps is None else checked_fps(fps)
    return _surveyed(path, detections, fps=fps, seconds=seconds, background=background, region=region).found


def _surveyed(path, detections, **options) -> Survey:
    """The first look, with `options` of `survey`, at a film whose `detections` say who is in it if there are any."""
    seen = survey(path, **options)
    return seen if detections is None else replace(seen, found=detected(people_of(detections, seen), seen))


def _check_choice(person, box, point, at, region) -> None:
    """Validate what says whom to follow."""
    given = [name for name, value in (("person", person), ("box", box), ("point", point)) if value is not None]
    if len(given) > 1:
        raise MotionError(f"give only one of person, box and point; got {' and '.join(given)}")
    if at is not None and box is None and point is None:
        raise MotionError("at is the moment of a box or point: give one of them")
    if person is not None:
        checked_whole(person, "person", 1)
    if at is not None:
        checked_number(at, "at", 0)
    for name, values, count in (("box", box, 4), ("point", point, 2), ("region", region, 4)):
        numbers = np.asarray([] if values is None else values, dtype=float)
        wrong = numbers.shape != (count,) or not np.isfinite(numbers).all() or (numbers[2:] <= 0).any()
        if values is not None and wrong:
            what = "x, y, width, height" if count == 4 else "x, y"
            raise MotionError(f"{name} must be {what} in the film's pixels, got {values!r}")


def _follower(
    close: Look, who: Candidate, frames: tuple[int, int], full: Camera, prior: Prior, options: tuple, rng, guide
) -> MultiStart:
    """The tracker of one person between two frames; `options` are its particles, layers and threads."""
    particles, layers, threads = options
    skeleton, fps = prior.skeleton, prior.fps
    view, boxes = close.camera(resized(full, *close.size)), close.boxes(who)[slice(*frames)]
    focal = np.sqrt(abs(np.linalg.det(view.K[:2, :2])))
    far = float(focal * skeleton.height / np.nanmedian(boxes[:, 3] - boxes[:, 2]))
    likelihood = SilhouetteLikelihood(
        view, skeleton, misses=_MISSES, false_alarms=_ALARMS, distance=far, threads=threads
    )
    back = MixturePrior(
        FPCAPrior(skeleton=skeleton, fps=fps, backwards=True), VelocityPrior(skeleton=skeleton, fps=fps)
    )
    merged = who.mover.merged[slice(*frames)]
    alone = np.where(merged[:, None], np.nan, boxes)
    begin = departure_frame(alone if np.isfinite(alone).any() else boxes, fps)
    if guide is not None and guide.known.any():
        begin = int(np.argmax(guide.known))
    return MultiStart(
        prior, back, likelihood, close.foreground, close.colours, merged, begin, particles, layers, rng, guide
    )


def _spread(part: np.ndarray, where: np.ndarray, first: int) -> np.ndarray:
    """Values of frames from `first` on, in an array of all frames (T, ...); NaN except `where` (T,)."""
    whole = np.full((len(where), *part.shape[1:]), np.nan)
    whole[first : first + len(part)] = part
    whole[~where] = np.nan
    return whole
