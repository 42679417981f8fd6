"""The angles of a limb: a ball joint, from the direction of the upper part, and the hinge below it.

The ball joint turns the limb by R_y(β) R_x(γ) R_z(ρ); its upper part then points along
u = (-cos γ sin β, sin γ, -cos γ cos β), and below the hinge the level part of the lower one is ∓sin f · (cos ρ, sin ρ).
So β is the direction of a vector of length cos γ, and ρ of one of length sin f: near gimbal lock and in a straight limb
they are undefined, and `steady_directions` continues them.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from motionenv.body.fitting._directions import steady_directions
from motionenv.body.skeleton import NODES


@dataclass(frozen=True)
class Limb:
    """A ball joint with a hinge below it.

    A hinge that seems to bend backwards by more than `overstretch` is turned, with the limb, by half a turn instead. A
    hip can't turn the knee backwards, while a shoulder can turn the elbow. Beyond `limit` overstretching is held back:
    knees bend backwards by 20° in some patients (genu recurvatum), and what is measured there must stay; elbows hardly
    ever by more than 5°.
    """

    at: int  # first of the limb's four entries in the pose vector
    signs: tuple[float, float, float]  # of flexion, abduction and rotation
    hinge: float  # sign of the hinge's flexion
    chain: tuple[int, int, int]  # proximal, middle and distal node, as indices into `NODES`
    overstretch: float  # sine of an angle
    limit: float  # angle [rad], or infinity


def _limb(at: int, signs: tuple[float, float, float], hinge: float, side: str) -> Limb:
    """A limb by the side of the body."""
    joints = ("shoulder", "elbow", "wrist") if hinge < 0 else ("hip", "knee", "ankle")
    first, middle, last = (NODES.index(f"{side}_{joint}") for joint in joints)
    overstretch, limit = (0.0, np.radians(5.0)) if hinge < 0 else (0.4, np.inf)
    return Limb(at, signs, hinge, (first, middle, last), overstretch, float(limit))


LIMBS = (
    _limb(9, (-1, 1, -1), -1, "left"), _limb(13, (-1, -1, 1), -1, "right"), _limb(17, (-1, 1, -1), 1, "left"),
    _limb(21, (-1, -1, 1), 1, "right"),
)  # fmt: skip

# From these lengths on, directions are taken exactly; below, they are averaged. Chosen on CMU's walks, whose files
# hold the rotation of thigh and upper arm as the capture system solved it from markers on them, and for the legs on
# walks of gait laboratories, too: knees that bend sideways by a few degrees, as marker sets make them, must not turn
# the hip outwards in stance.
_SWING: dict[str, Any] = {"known": 0.3, "stiffness": 3e-4}
_TWIST: dict[float, dict[str, Any]] = {
    -1.0: {"known": 0.25, "stiffness": 2e-4},
    1.0: {"known": 0.35, "stiffness": 1e-2},
}
#: Cost per frame of a limb that hangs by being abducted by 180°, which after a movement overhead it may.
_REVERSED = 2e-4


def limb_angles(limb: Limb, upper: np.ndarray, far: np.ndarray, length: float, fps: float) -> np.ndarray:
    """Flexion, abduction and rotation of the ball joint, flexion of the hinge: (frames, 4) [rad], NaN where unknown.

    `upper` and `far` (frames, 3) are from the proximal to the middle and the distal node, in the torso's frame;
    `length` [m] is that of the upper part.
    """
    out = np.full((len(upper), 4), np.nan)
    time = np.arange(len(upper)) / fps
    seen = np.isfinite(upper).all(-1)
    beta, gamma = _swing(_unit(upper[seen]), time[seen])
    out[seen, 0], out[seen, 1] = beta, gamma
    both = seen & np.isfinite(far).all(-1)
    rho, bend = _twist_and_bend(limb, out[both, 0], out[both, 1], far[both], length, time[both])
    out[both, 2], out[both, 3] = rho, bend
    return _centred(out) * [*limb.signs, 1.0]


def _swing(u, time) -> tuple[np.ndarray, np.ndarray]:
    """Continuous β and γ (frames,) [rad] that turn a limb into the directions u (frames, 3)."""
    level = -u[:, 2] - 1j * u[:, 0]
    beta = steady_directions(level, time, np.ones(len(u)), reverse=_REVERSED * np.maximum(-u[:, 2], 0.0), **_SWING)
    gamma = np.arctan2(u[:, 1], (level * np.exp(-1j * beta)).real)
    return beta, np.unwrap(gamma)


def _twist_and_bend(limb: Limb, beta, gamma, far, length, time) -> tuple[np.ndarray, np.ndarray]:
    """Continuous ρ and the flexion of the hinge (frames,) [rad]."""
    if not len(time):
        return np.empty(0), np.empty(0)
    axes = _axes(beta, gamma)
    lower = np.einsum("tij,ti->tj", axes, _unit(far + length * axes[:, :, 2]))
    level = -limb.hinge * (lower[:, 0] + 1j * lower[:, 1])
    drift = np.concatenate([[0.0], np.cumsum(_turn_between(axes[:-1], axes[1:]))])
    neutral = _neutral(axes) * np.exp(-1j * drift)
    fixed = _faced(level * np.exp(-1j * drift), neutral, limb.overstretch)
    rho = steady_directions(fixed, time, neutral, **_TWIST[limb.hinge]) + drift
    bend = np.arctan2((level * np.exp(-1j * rho)).real, -lower[:, 2])
    return rho, _held_back(bend, limb.limit)


def _axes(beta, gamma) -> np.ndarray:
    """R_y(β) R_x(γ) as (frames, 3, 3)."""
    cb, sb, cg, sg = np.cos(beta), np.sin(beta), np.cos(gamma), np.sin(gamma)
    rows = [[cb, sb * sg, sb * cg], [np.zeros_like(cb), cg, -sg], [-sb, cb * sg, cb * cg]]
    return np.moveaxis(np.array(rows), -1, 0)


def _turn_between(before, after) -> np.ndarray:
    """Angle (frames,) [rad] about the limb from `after` (frames, 3, 3) to `before` swung without twist onto it.

    The shortest turn from one axis onto the other leaves a limb untwisted (parallel transport): rotation about the limb
    is compared between frames after it, so that gimbal lock, where the axes spin about the limb, doesn't matter.
    """
    w, x, z = before[:, :, 2], before[:, :, 0], after[:, :, 2]
    along = 1.0 + (w * z).sum(-1, keepdims=True)
    swung = x - (x * z).sum(-1, keepdims=True) / np.maximum(along, 1e-9) * (w + z)
    return np.arctan2((swung * after[:, :, 1]).sum(-1), (swung * after[:, :, 0]).sum(-1))


def _neutral(axes) -> np.ndarray:
    """Direction of the limb's front after the shortest swing from hanging, as complex numbers.

    (frames,), of length 1 for a limb that hangs to 0 for one that points straight up, to where no turn is shortest.
    """
    z = axes[:, :, 2]
    share = 1.0 + z[:, 2]
    front = np.stack([share - z[:, 0] ** 2, -z[:, 0] * z[:, 1], -z[:, 0] * share], axis=-1)
    front /= np.maximum(share, 1e-9)[:, None]
    level = np.einsum("tij,ti->tj", axes, front)
    return 0.5 * share * (level[:, 0] + 1j * level[:, 1])


def _faced(level, neutral, overstretch: float) -> np.ndarray:
    """Vectors of the hinge, those turned round that point backwards because the hinge is overstretched.

    Turned round and not are blended where a vector points sideways, and where its length is about `overstretch`: it
    then is short, and tells little.
    """
    if overstretch <= 0.0:
        return level
    size = np.abs(level)
    facing = (level * neutral.conj()).real / np.maximum(size * np.abs(neutral), 1e-12)
    turned = np.clip((facing + 0.4) / 0.3, -1.0, 1.0)
    share = np.clip((size / overstretch - 0.8) / 0.4, 0.0, 1.0)
    return level * (turned + (1.0 - turned) * share)


def _held_back(bend, limit: float) -> np.ndarray:
    """Flexion of a hinge [rad], softly kept above -`limit`; from half of it upwards, nothing changes."""
    if not np.isfinite(limit):
        return bend
    half = 0.5 * limit
    return np.where(bend < -half, -half + half * np.tanh((bend + half) / half), bend)


def _centred(angles) -> np.ndarray:
    """Angles (frames, 4) of the same rotations with abduction within ±90° and the others around 0, in most frames."""
    known = angles[np.isfinite(angles[:, 0])]
    if len(known) and np.median(np.cos(known[:, 1])) < 0:
        angles[:, 0] += np.pi
        angles[:, 1] = np.pi - angles[:, 1]
        angles[:, 2] += np.pi
    for column in angles.T[:3]:
        some = column[np.isfinite(column)]
        if len(some):
            column -= 2 * np.pi * np.round(np.median(some) / (2 * np.pi))
    return angles


def _unit(v: np.ndarray) -> np.ndarray:
    """Vectors (..., 3) normalised to length 1; 0 stays 0."""
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-12)
