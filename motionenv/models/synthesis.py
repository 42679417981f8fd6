"""One way to ask any walking model for a motion."""

from collections.abc import Sequence
from copy import deepcopy

import numpy as np

from motionenv.body.skeleton import limb_radii
from motionenv.errors import MotionError
from motionenv.models.eigenwalkers import Eigenwalkers
from motionenv.models.store import load
from motionenv.models.walking import Stride, WalkingModel
from motionenv.types import Motion, Skeleton, checked_fps

__all__ = ["components", "scaled", "synthesize"]


def synthesize(
    model,
    seconds: float,
    fps: float,
    *,
    seed=None,
    speed: float | None = None,
    height: float | None = None,
    phase: float = 0.0,
    variation: float = 1.0,
    deviations: Sequence[float] | None = None,
    scores: Sequence[float] | None = None,
) -> Motion:
    """A walk (frames, 25) along x from the model called `model`; from a tree, motion of the kinds that it knows.

    Who walks is drawn with the seed, or given by `deviations` or `scores`, which end where the rest is average. Then
    the pace is the one to be expected of such a walker, and the seed says how the cycles vary.

    Args:
        model: a name or path for `motionenv.load`, or a fitted model.
        seconds: duration [s].
        fps: frames per second.
        seed: int or Generator.
        speed: walking speed [m/s], or None for the walker's own.
        height: body height [m], or None for the model's.
        phase: where in the cycle to start [cycles]; a tree has no cycles and takes neither this nor `variation`.
        variation: factor on how much the cycles of a walk differ; eigenwalkers repeat one cycle, whatever it is.
        deviations: the walker, as standard deviations √`explained_variance_` from the average person's scores; not of
            a tree.
        scores: the walker, as the model's own scores; not together with `deviations`.

    From a tree it is whatever the database holds, softly steered to `speed` where that is given.

    Raises:
        MotionError: a number out of range, a model that makes no motion, or a tree with a phase, variation or scores.
        ModelError: no such model.
    """
    fitted = load(model) if isinstance(model, str) or not hasattr(model, "kind") else model
    given = _given_scores(fitted, deviations, scores)
    if isinstance(fitted, WalkingModel):
        stride = None if given is None else Stride(given[None], fitted.stride_seconds(given)[None])
        return fitted.synthesize(
            seconds, fps, seed=seed, stride=stride, speed=speed, height=height, phase=phase, variation=variation
        )
    if isinstance(fitted, Eigenwalkers):
        return _from_eigenwalkers(fitted, seconds, fps, seed, given, speed, height, phase)
    if fitted.kind == "tree":
        if phase != 0.0 or variation != 1.0:
            raise MotionError(
                "a tree has no cycles: leave phase and variation out; temperature is in `motionenv sample`"
            )
        return _from_tree(fitted, seconds, checked_fps(fps), seed, speed, height)
    raise MotionError(f"{model!r} is a {fitted.kind} model, which doesn't walk; see `motionenv models`")


def components(model) -> tuple[np.ndarray, np.ndarray]:
    """The average person's scores (q,) and the standard deviation (q,) along each component of a walking model.

    Args:
        model: a fitted `WalkingModel` or `Eigenwalkers`.

    Raises:
        MotionError: a model without components.
    """
    if isinstance(model, WalkingModel):
        deviation = np.sqrt(model.fpca_.explained_variance_)
        return model.person_mean_[: len(deviation)], deviation
    if isinstance(model, Eigenwalkers):
        return np.zeros(len(model.explained_variance_)), np.sqrt(model.explained_variance_)
    raise MotionError(f"a {model.kind} model has no components: leave deviations and scores out")


def _given_scores(model, deviations, scores) -> np.ndarray | None:
    """Scores (q,) of the walker that is asked for, or None where it is to be drawn.

    Raises:
        MotionError: both are given, too many, not finite, or the model has none.
    """
    if deviations is None and scores is None:
        return None
    if deviations is not None and scores is not None:
        raise MotionError("deviations and scores both say who walks: give one of them")
    name, given = ("scores", scores) if deviations is None else ("deviations", deviations)
    mean, deviation = components(model)
    values = np.asarray(given, dtype=np.float64)
    if values.ndim != 1 or len(values) > len(mean) or not np.isfinite(values).all():
        raise MotionError(f"{name} must be up to {len(mean)} finite numbers, one per component; got {given!r}")
    made = mean.copy()
    made[: len(values)] = values if deviations is None else mean[: len(values)] + values * deviation[: len(values)]
    return made


def _from_eigenwalkers(model: Eigenwalkers, seconds, fps, seed, k, speed, height, phase) -> Motion:
    """A walk of the walker with scores `k`, or of one drawn."""
    if height is None or speed is None:
        motion = model.walker_motion(seconds, fps, k=k, seed=seed, speed=speed, phase=phase)
        return motion if height is None else scaled(motion, height)
    # Scaling a body scales its speed: pace the walker so that it is right afterwards.
    rng = np.random.default_rng(seed)
    own = model.walker_motion(1.0, fps, k=k, seed=deepcopy(rng)).skeleton.height
    motion = model.walker_motion(seconds, fps, k=k, seed=rng, speed=speed * own / height, phase=phase)
    return scaled(motion, height)


def _from_tree(tree, seconds: float, fps: float, seed, speed: float | None, height: float | None) -> Motion:
    """Motion (frames, 25) that grows from a `MotionTree` at 30 frames/s, then at `fps` by cubic splines."""
    from motionenv.models.tree import growth, resample
    from motionenv.models.tree.frames import FPS

    if not (0 < seconds <= 3600 and fps <= 1000 and round(seconds * fps) >= 1):
        raise MotionError(f"seconds must be up to 3600, fps to 1000, at least one frame; got {seconds!r}, {fps!r}")
    own = tree.database_.skeleton.height
    target = growth.Target(speed=None if speed is None else speed * own / (height or own))
    motion = growth.synthesize(tree, seconds + 2 / FPS, seed=seed, target=target)
    if fps != FPS:
        motion = Motion(resample(motion, fps)[0], motion.skeleton, fps, motion.name)
    motion = Motion(motion.poses[: round(seconds * fps)], motion.skeleton, fps, motion.name)
    return motion if height is None else scaled(motion, height)


def scaled(motion: Motion, height: float) -> Motion:
    """The same motion of a body scaled to `height` [m]: angles and seconds stay, lengths and speed scale.

    Args:
        motion: any motion.
        height: body height [m], 0.5 to 2.5.

    Raises:
        MotionError: `height` out of range.
    """
    if not 0.5 <= height <= 2.5:
        raise MotionError(f"height must be from 0.5 to 2.5 m, got {height!r}")
    factor = height / motion.skeleton.height
    poses = motion.poses.copy()
    poses[..., :3] *= factor
    return Motion(
        poses, Skeleton(motion.skeleton.offsets * factor, limb_radii(height), height), motion.fps, motion.name
    )
