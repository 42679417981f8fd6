r"""One cycle of a walk on the spot, as on a treadmill: what the page of the service shows while sliders are moved.

It is what the models of walking do over the ground, with two differences: nothing varies from cycle to cycle, and what
is smooth over time there is smooth around the cycle here. The ground moves back evenly; how the body's own speed
differs from that within a cycle is in its motion. `service/web/src/walkers` computes the same in the
browser, within 1e-6.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import gaussian_filter1d

from motionenv._core.representation import OneLine
from motionenv._core.validation import checked_number
from motionenv.body.gaps import known_markers
from motionenv.body.kinematics import FOOT_BALL, feet, markers
from motionenv.body.skeleton import ANKLE_HEIGHT, LIMB_SHIFTS, LIMBS, NODES
from motionenv.errors import MotionError
from motionenv.models.contact_rule import CONTACT
from motionenv.models.eigenwalkers.fourier_series import body_heights, grounded, positions_at
from motionenv.models.eigenwalkers.speed import at_speed
from motionenv.models.walking.tables import in_order, lacking_angles
from motionenv.types import HEIGHT_RANGE, MARKERS, POSE, SPEED_RANGE, Skeleton

if TYPE_CHECKING:
    from motionenv.models.eigenwalkers.fourier_model import FourierModel
    from motionenv.models.walking.model import WalkingModel

SAMPLES = 96  #: of a cycle, at which contact is looked at

_HINGES = [i for i, name in enumerate(POSE) if "elbow" in name or "knee" in name]
_HIPS = [POSE.index("left_hip_flexion"), POSE.index("right_hip_flexion")]  # abduction comes next
_HIP_NODES = [NODES.index("left_hip"), NODES.index("right_hip")]
_MIDSWING = (0.8, 0.3)  # [cycles] phase at which the left and the right foot is in the air
_FOOT = LIMB_SHIFTS[LIMBS.index("left_foot")]  # heel and toe from the ankle [body heights]
_LEGS = [[MARKERS.index(f"{side}_{joint}") for joint in ("hip", "knee", "ankle")] for side in ("left", "right")]


@dataclass(frozen=True, eq=False, repr=False)
class InPlace(OneLine):
    """One cycle of each of some walkers, who go along x on ground that moves back evenly.

    Attributes:
        frames: poses (..., samples, 25) or markers (..., samples, 15, 3), at phases j / samples; phase 0 is the left
            leg furthest ahead, and the origin is under the walker on average.
        strides: (...) how far a cycle goes [m].
        seconds: (...) how long it takes [s].
    """

    frames: np.ndarray
    strides: np.ndarray
    seconds: np.ndarray

    @property
    def speeds(self) -> np.ndarray:
        """(...) [m/s]."""
        return self.strides / self.seconds


def walk_in_place(
    model: WalkingModel, scores: ArrayLike, *, speed: float | None = None, height: float | None = None
) -> InPlace:
    """Cycles of walkers with `scores` (..., q), at the stride time that suits them, or that makes a `speed` [m/s].

    The fitted `model` gives walkers of body `height` [m], None for the mean. A `MotionError` if a number is out of
    range, or scores have another shape.
    """
    body, scores = model.skeleton(height), np.asarray(scores, dtype=np.float64)
    if scores.ndim == 0 or scores.shape[-1] != model.fpca_.n_components or not np.isfinite(scores).all():
        raise MotionError(f"scores must be finite, of shape (..., {model.fpca_.n_components}), got {scores.shape}")
    if speed is not None:
        checked_number(speed, "speed", *SPEED_RANGE)
    flat = scores.reshape(-1, scores.shape[-1])
    seconds = model.stride_seconds(flat)
    if speed is not None:
        components = model.components()
        z, seconds = model.pace_.at_speed(model.standard(flat), seconds, body.height, speed)
        flat = components.means + z * components.deviations
    channels = model.fpca_.evaluate(flat[:, None], np.arange(SAMPLES) / SAMPLES)
    channels = in_order(channels, model.fpca_.channels_, np.nan)
    poses = np.zeros((len(flat), SAMPLES, 25))
    poses[..., 6:], poses[..., 3:6] = channels[..., :19], channels[..., 19:22]
    hinges = [i for i in _HINGES if i not in lacking_angles(model)]
    poses[..., hinges] = CONTACT.stiffness * np.logaddexp(0.0, poses[..., hinges] / CONTACT.stiffness)
    floor = np.percentile(channels[..., 22:], 10, axis=1)[:, None]
    above = CONTACT.give * np.logaddexp(0.0, (channels[..., 22:] - floor) / CONTACT.give)
    ankles = body.height * (ANKLE_HEIGHT + above)
    for _ in range(1 if speed is None else CONTACT.turns):
        walked, strides = _carried(poses, ankles, SAMPLES / seconds, body)
        if speed is not None:
            seconds = strides / speed
    lead = scores.shape[:-1]
    return InPlace(walked.reshape(*lead, SAMPLES, 25), strides.reshape(lead), seconds.reshape(lead))


def markers_in_place(
    model: FourierModel, scores: np.ndarray, *, speed: float | None = None, height: float | None = None
) -> InPlace:
    """Cycles of walkers of a fitted `model` with `scores` (..., N) [m], as the 15 markers.

    `speed` is in m/s, None for the pace that suits the scores; `height` in metres, None for the body that the scores
    say. A `MotionError` if one is out of range, or scores have another shape.
    """
    seconds, w = 1 / model.frequency(scores), model.inverse_transform(scores)
    lead, flat, seconds = w.shape[:-3], w.reshape(-1, *w.shape[-3:]), np.reshape(seconds, -1)
    if height is not None:
        checked_number(height, "height", *HEIGHT_RANGE)
    if speed is not None:
        checked_number(speed, "speed", *SPEED_RANGE)
        flat = at_speed(model, flat, seconds, speed if height is None else speed * body_heights(flat) / height)
    flat = grounded(flat)
    scale = np.ones(len(flat)) if height is None else height / body_heights(flat)
    cycle = positions_at(flat, np.arange(SAMPLES) * (2 * np.pi / SAMPLES))
    ball = _balls(cycle, body_heights(flat))
    back = -_slope(ball[..., 0]) * SAMPLES  # [m per cycle]
    fastest = back.max(axis=2, keepdims=True)
    stands = np.exp((back - fastest) / (CONTACT.marker_firmness * fastest.max(axis=1, keepdims=True)))
    stands /= stands.sum(axis=2, keepdims=True)
    velocity = -(stands[..., None] * _slope(ball[..., :2])).sum(axis=2) * SAMPLES
    way, stride = _evenly(velocity)
    cycle[..., :2] += way[:, :, None]
    _turned(cycle[..., :2], stride)
    strides = scale * np.hypot(stride[:, 0], stride[:, 1])
    seconds = seconds if speed is None else strides / speed
    cycle *= scale[:, None, None, None]
    return InPlace(cycle.reshape(*lead, *cycle.shape[1:]), strides.reshape(lead), seconds.reshape(lead))


def pose_series(model: WalkingModel) -> dict[str, np.ndarray]:
    """Fourier series of a fitted `model`'s channels and its stride times, as in `motionenv.models.parameters`.

    Columns of its basis are scaled to amplitude 1. The mean of channels that the model lacks is NaN.
    """
    fpca, components = model.fpca_, model.components()
    scale = np.full(2 * fpca.n_harmonics - 1, np.sqrt(2 / len(fpca.mean_)))
    scale[0] = np.sqrt(1 / len(fpca.mean_))
    steps = np.concatenate([np.zeros((1, len(components))), np.diag(components.deviations)])
    log_seconds = np.log(model.stride_seconds(components.means + steps))
    return {
        "mean": in_order(scale[:, None] * fpca.mean_coefficients_, fpca.channels_, np.nan),
        "components": in_order(scale[:, None] * fpca.component_coefficients_, fpca.channels_, 0.0),
        "log_seconds_mean": log_seconds[0],
        "log_seconds_weights": log_seconds[1:] - log_seconds[0],
        **model.pace_.to_arrays(),
    }


def marker_series(model: FourierModel) -> dict[str, np.ndarray]:
    """Fourier series of a fitted `model`'s markers and its frequencies, as in `motionenv.models.parameters`."""
    return {
        "mean": model.mean_,
        "components": model.components_,
        "log_frequency_mean": np.asarray(model.log_frequency_mean_),
        "log_frequency_weights": model.log_frequency_weights_,
        "speed_direction": model.speed_direction_,
        "speed_exponent": np.asarray(model.speed_exponent_),
    }


def walk_cycles(
    model: WalkingModel, scores: np.ndarray, speed: float | None = None, height: float | None = None
) -> tuple[InPlace, np.ndarray, np.ndarray]:
    """Cycles of `scores` (n, q) of a fitted `model`, their markers (n, samples, 15, 3) and body heights (n,) [m].

    At a `speed` [m/s] and of a body `height` [m], if they are given.
    """
    cycle, body = walk_in_place(model, scores, speed=speed, height=height), model.skeleton(height)
    shown = np.where(known_markers(cycle.frames)[..., None], markers(cycle.frames, body), np.nan)
    return cycle, shown, np.full(len(scores), body.height)


def marker_cycles(
    model: FourierModel, scores: np.ndarray, speed: float | None = None, height: float | None = None
) -> tuple[InPlace, np.ndarray, np.ndarray]:
    """What `walk_cycles` gives, of walkers with `scores` (n, q) [m] of a fitted `model` of markers.

    Args:
        model, scores: see above.
        speed, height: as of `walk_cycles`.
    """
    cycle = markers_in_place(model, scores, speed=speed, height=height)
    own = body_heights(model.inverse_transform(scores))
    return cycle, cycle.frames, own if height is None else np.full(len(own), float(height))


def _carried(poses, heights, rate, body: Skeleton) -> tuple[np.ndarray, np.ndarray]:
    """Poses (n, samples, 25) whose standing feet go back evenly, and how far a cycle goes (n,) [m].

    Like `motionenv.models.walking.model` over the ground, but closed to a ring. Roots are at the origin, `heights` (n,
    samples, 2) [m] the ankles', and `rate` (n,) samples per second.
    """
    poses, seconds = poses.copy(), 1 / rate
    ankles = feet(poses, body)[0]
    back = -_slope(ankles[..., 0]) * rate[:, None, None]
    stands = np.exp((back - back.max(-1, keepdims=True)) / CONTACT.firmness)
    stands /= stands.sum(-1, keepdims=True)
    poses[..., 2] = (_smooth(stands, CONTACT.shifting * rate) * (heights - ankles[..., 2])).sum(-1)
    ankles, balls = feet(poses, body)
    ball = balls[..., :2]
    velocity = -(stands[..., None] * _slope(ball)).sum(2) * rate[:, None, None]
    way, stride = _evenly(_smooth(velocity, CONTACT.smoothing * rate) * (seconds * SAMPLES)[:, None, None])
    poses[..., :2] = way
    _plant(poses, _slip(ball + way[:, :, None], stride, stands, rate), ankles, body)
    _turned(poses[..., :2], stride)
    poses[..., 5] -= np.arctan2(stride[:, 1], stride[:, 0])[:, None]
    return poses, np.hypot(stride[:, 0], stride[:, 1])


def _slip(ball, stride, stands, rate) -> np.ndarray:
    """By how much (n, samples, 2, 2) [m] to move the balls of the feet so that they go back evenly on average."""
    count = ball.shape[1]
    cycles = np.arange(count)[:, None] / count
    cycles = cycles + (cycles < _MIDSWING)  # a step is one foot's way from midswing to midswing
    placed = ball + cycles[..., None] * stride[:, None, None]
    weight = stands[..., None]
    slip = (weight * placed).sum(1, keepdims=True) / np.maximum(weight.sum(1, keepdims=True), 1e-9) - placed
    surely = (stands * np.exp(-((slip / CONTACT.reach) ** 2).sum(-1)))[..., None]
    width = CONTACT.settling * rate
    return _smooth(surely * slip, width) / (_smooth(surely, width) + CONTACT.looseness)


def _plant(poses, slip, ankles, body: Skeleton) -> None:
    """Turn the hips so that the feet move by `slip` (n, samples, 2, 2); `ankles` are those of roots at x = y = 0."""
    forward, left = np.cos(poses[..., 5]), np.sin(poses[..., 5])
    for side, outwards in enumerate((1, -1)):
        depth = poses[..., 2] + body.offsets[_HIP_NODES[side], 2] - ankles[..., side, 2]
        x, y = slip[..., side, 0], slip[..., side, 1]
        poses[..., _HIPS[side]] += (forward * x + left * y) / depth
        poses[..., _HIPS[side] + 1] += outwards * (forward * y - left * x) / np.hypot(depth, ankles[..., side, 0])


def _balls(positions, heights) -> np.ndarray:
    """Balls of the feet (n, samples, 2, 3) [m], left then right, of walkers of `heights` (n,) [m].

    The foot points where the shin bends to, level sideways, and is as flat as the ankle's height lets it be, as in
    `motionenv.body.limb_segments`.
    """
    hip, knee, ankle = (positions[..., [leg[i] for leg in _LEGS], :] for i in range(3))
    up = knee - ankle
    up /= np.linalg.norm(up, axis=-1, keepdims=True)
    across = hip[..., :1, :] - hip[..., 1:, :]
    left = across - (across * up).sum(-1, keepdims=True) * up
    front = np.cross(left, up)
    level = left[..., :2] / np.linalg.norm(left[..., :2], axis=-1, keepdims=True)
    ahead = np.stack([level[..., 1], -level[..., 0]], axis=-1)
    size = heights[:, None, None]
    rigid = np.arctan2(-front[..., 2], (front[..., :2] * ahead).sum(-1))
    down = _toe_down(rigid, ankle[..., 2] / size - ANKLE_HEIGHT)
    toe, sole = FOOT_BALL[0] * size, -FOOT_BALL[2] * size
    out = ankle.copy()
    out[..., :2] += (toe * np.cos(down) - sole * np.sin(down))[..., None] * ahead
    out[..., 2] -= toe * np.sin(down) + sole * np.cos(down)
    return out


def _toe_down(rigid, free) -> np.ndarray:
    """The angle (...) [rad] at which a foot is held whose shin asks for `rigid`, with `free` [body heights] to drop."""
    (heel, heel_sole), (toe, toe_sole) = (_FOOT[:, [0, 2]] * [[-1.0, -1.0], [1.0, -1.0]]).tolist()
    sine = lambda along, below: np.arcsin(np.clip((free + below) / np.hypot(along, below), -1.0, 1.0))
    most = sine(toe, toe_sole) - np.arctan2(toe_sole, toe)
    least = np.arctan2(heel_sole, heel) - sine(heel, heel_sole)
    return np.minimum(np.maximum(rigid, np.minimum(least, 0.0)), np.maximum(most, -0.3))


def _evenly(velocity) -> tuple[np.ndarray, np.ndarray]:
    """The way (n, samples, 2) [m] of `velocity` [m/cycle] less an even one, 0 on average, and a cycle's (n, 2) [m]."""
    stride = velocity.mean(axis=1)
    rest = (velocity - stride[:, None]) / velocity.shape[1]
    way = np.cumsum(0.5 * (rest + np.roll(rest, 1, axis=1)), axis=1)
    return way - way.mean(axis=1, keepdims=True), stride


def _turned(places, stride) -> None:
    """Turn `places` (n, ..., 2) about the origin so that `stride` (n, 2) goes along x."""
    x, y = places[..., 0].copy(), places[..., 1].copy()
    cosine, sine = (stride / np.hypot(stride[:, 0], stride[:, 1])[:, None]).T.reshape(2, -1, *[1] * (x.ndim - 1))
    places[..., 0], places[..., 1] = cosine * x + sine * y, cosine * y - sine * x


def _slope(values) -> np.ndarray:
    """Central differences (n, samples, ...) around the cycle [per sample]."""
    return 0.5 * (np.roll(values, -1, axis=1) - np.roll(values, 1, axis=1))


def _smooth(values, widths) -> np.ndarray:
    """`values` (n, samples, ...) smoothed around the cycle by Gaussians of standard deviations `widths` (n,)."""
    return np.stack([gaussian_filter1d(v, w, axis=0, mode="wrap") for v, w in zip(values, widths, strict=True)])
