"""Functional joints, found by movement: of two segments, and of legs with rigid clusters but no markers on the joints.

SCoRE, the symmetrical centre of rotation estimation (Ehrig, Taylor, Duda & Heller 2006, J Biomech 39, eq. 6): the point
that is fixed in both segments in the sense of least squares. SARA, the symmetrical axis of rotation approach (Ehrig,
Taylor, Duda & Heller 2007, J Biomech 40): the direction along which that point is determined least, which is the axis
where the joint is a hinge.

Walking turns hips, knees and ankles about axes that are nearly lateral, so it determines their centres in the sagittal
plane, but hardly how far out they are. That comes from the body:

- hips are as far apart as those of people with thighs of that length (Winter 2009, fig. 4.1);
- the leg, seen from the front and stretched, is a straight line from the hip, which runs such that the outermost
  markers of thigh and shank are as far outside of it as the limbs are thick.

Where ASIS and sacrum show the pelvis and knees and ankles have markers too, knees lie 7 to 19 mm and ankles 14 to 44
mm from those of the markers, and knee flexion differs by 1 to 6 degrees rms (`benchmarks/mocap/clusters.py`: four
trials of two people). Where only a cluster shows the pelvis, its tilt and the hips' distance are guesses, and errors
are larger.
"""

from dataclasses import dataclass, field

import numpy as np

from motionenv._core.representation import OneLine
from motionenv.errors import GapError
from motionenv.mocap.clinical.clusters import cluster_pose
from motionenv.mocap.clinical.gait_model import NEUTRAL_TILT, SIGN, Segment, middle, unit

_FEWEST = 10  # frames that show both segments
_NOTHING = 1e-6  # [rad] swing below which a direction can't be told at all


@dataclass(frozen=True, eq=False, repr=False)
class FunctionalJoint(OneLine):
    """A joint between a proximal and a distal segment.

    Attributes:
        centre: (frames, 3) [m] the point that is fixed in both segments; NaN where neither is seen.
        axis: (frames, 3) direction, of length 1, along which the centre is determined least: a hinge's axis. Its sense
            is arbitrary.
        swings: (3,) [rad] rms rotation of the segments against each other that determines the centre, in each of three
            perpendicular directions, largest first. The last is that along `axis`: 0 for a hinge.
    """

    centre: np.ndarray
    axis: np.ndarray
    swings: np.ndarray


def functional_joint(proximal: Segment, distal: Segment, *, hinge: bool = False) -> FunctionalJoint:
    """The joint between two segments, by SCoRE and SARA.

    With rotations R, S and origins t, d of the two segments, the centres c1, c2 in them minimise the sum over frames of
    |R c1 + t - S c2 - d|². The singular values of this system come in pairs sqrt(1 ± s), with s those of the mean of
    Rᵀ S; the three small ones, times sqrt(2), are the rms rotations perpendicular to a direction, which determine the
    centre along it. A direction without any rotation is cut off, as is the axis of a hinge: along it, the centre is the
    point nearest to the segments' origins.

    Args:
        proximal, distal: poses of the segments (frames, …), NaN where unknown.
        hinge: whether to leave the centre open along the axis even where some rotation seems to determine it, as that
            of knees is mostly skin that moves.

    Raises:
        GapError: fewer than ten frames show both segments.
    """
    r, t, s, d = proximal.rotation, proximal.origin, distal.rotation, distal.origin
    both = np.isfinite(t).all(-1) & np.isfinite(d).all(-1)
    if both.sum() < _FEWEST:
        raise GapError(f"a functional joint needs {_FEWEST} frames that show both segments; there are {both.sum()}")
    system = np.concatenate([r[both], -s[both]], axis=-1).reshape(-1, 6) / np.sqrt(both.sum())
    right = (d - t)[both].reshape(-1) / np.sqrt(both.sum())
    u, values, vectors = np.linalg.svd(system, full_matrices=False)
    swings = np.sqrt(2.0) * values[3:]
    kept = np.concatenate([np.ones(3, dtype=bool), swings > _NOTHING])
    kept[5] &= not hinge
    solution = vectors[kept].T @ ((u[:, kept].T @ right) / values[kept])
    centre = _mean(r @ solution[:3] + t, s @ solution[3:] + d)
    return FunctionalJoint(centre, unit(_mean(r @ vectors[5, :3], s @ vectors[5, 3:])), swings)


def _mean(proximal: np.ndarray, distal: np.ndarray) -> np.ndarray:
    """Mean (frames, 3) of what both segments say, or what the one that is seen says."""
    known = np.isfinite(proximal).astype(int) + np.isfinite(distal)
    total = np.where(np.isfinite(proximal), proximal, 0.0) + np.where(np.isfinite(distal), distal, 0.0)
    return np.where(known > 0, total / np.maximum(known, 1), np.nan)


_SIZE = 5  # markers of the largest cluster that has names
_FOOT = ("heel", "toe", "metatarsal_1", "metatarsal_5")
_BALL = np.radians(10.0)  # least swing that determines a hip's distance from the midline, as in star-arc movements
_MOVES = {"hip": np.radians(5.0), "knee": np.radians(5.0), "ankle": np.radians(3.0)}  # least swings; sway has 1 to 2°
_HALF_PELVIS = 0.050 / 0.245  # hip to midline, relative to hip to knee (Winter 2009, fig. 4.1)
# How far outside of the leg's axis the outermost marker is, relative to hip to knee: medians of the captures
# above, which have clusters beside markers on the joints.
_THICK = {"thigh": 0.23, "shank": 0.17}
_LEVER = 0.1  # [m] from the foot to the point on its side that turns with the shank
_HOW = "functional, from clusters: {}"
_SAGITTAL = "SCoRE in the sagittal plane (Ehrig et al. 2006), {} by the body's proportions"


@dataclass(frozen=True, eq=False)
class FunctionalLegs:
    """Joints of the legs as found from clusters.

    Attributes:
        landmarks: joint centres, and points on the lateral side of the knees' axes, by the names of landmarks, each
            (frames, 3) [m].
        pelvis: the pelvis, if clusters have to tell it: origin between the hips; y along the hips; on average upright,
            with the usual tilt.
        how: for each joint, how its centre was found.
    """

    landmarks: dict[str, np.ndarray] = field(default_factory=dict)
    pelvis: Segment | None = None
    how: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class _Limb:
    """One leg's clusters: markers (frames, markers, 3), poses, and the knee between them with its axis outwards."""

    markers: dict[str, np.ndarray]
    thigh: Segment
    shank: Segment
    knee: FunctionalJoint
    outward: np.ndarray


def functional_legs(
    positions: dict[str, np.ndarray], base: Segment | None, hips: dict[str, np.ndarray]
) -> FunctionalLegs:
    """Joint centres of those legs that have clusters on thigh and shank and no marker on the knee.

    `positions` are landmarks (frames, 3) [m], `base` is the pelvis by its landmarks, None if they aren't there, and
    `hips` the centres (frames, 3) [m] that are known otherwise, by side.

    Raises:
        GapError: a knee or hip hardly moves, or clusters are hardly seen; names the joint.
    """
    limbs = {side: limb for side in SIGN if (limb := _limb(positions, side, base)) is not None}
    pelvis, how = None, {}
    known = {side: hips[side] for side in limbs if side in hips}
    if limbs and not known:
        known, pelvis = _hips(positions, limbs)
        how = {"hip": _HOW.format(_SAGITTAL.format("their distance"))} if known else {}
        if pelvis is not None:
            how["pelvis"] = "by a cluster, taken to be upright on average"
    landmarks = {f"{side}_hip": hip for side, hip in known.items()}
    for side in known:
        landmarks.update(_below(positions, side, limbs[side], known[side]))
    for joint, axis in (("knee", "on SARA's axis (Ehrig et al. 2007)"), ("ankle", "about the knee's axis")):
        if any(name.endswith(f"_{joint}") for name in landmarks):
            how[joint] = _HOW.format(f"{_SAGITTAL.format('its distance from the midline')}, {axis}")
    return FunctionalLegs(landmarks, pelvis, how)


def _limb(positions, side: str, base: Segment | None) -> _Limb | None:
    """The clusters of one leg and the knee between them; None without clusters or if the knee has markers."""
    if f"{side}_knee" in positions or f"{side}_knee_lateral" in positions:
        return None
    on_thigh, on_shank = (_cluster(positions, f"{side}_{name}") for name in ("thigh", "shank"))
    if on_thigh is None or on_shank is None:
        return None
    thigh, shank = cluster_pose(on_thigh), cluster_pose(on_shank)
    left = _leftward(positions, base)
    if thigh is None or shank is None or left is None:
        return None
    knee = _moving(functional_joint(thigh, shank, hinge=True), side, "knee")
    return _Limb({"thigh": on_thigh, "shank": on_shank}, thigh, shank, knee, _turned(knee.axis, SIGN[side] * left))


def _cluster(positions, name: str) -> np.ndarray | None:
    """The markers (frames, markers, 3) of a cluster; None if there are fewer than three."""
    found = [positions[key] for i in range(1, _SIZE + 1) if (key := f"{name}_cluster_{i}") in positions]
    return np.stack(found, axis=1) if len(found) > 2 else None


def _leftward(positions, base: Segment | None) -> np.ndarray | None:
    """Approximate direction to the left (frames, 3): of the pelvis, or from the right thigh's cluster to the left's."""
    if base is not None:
        return base.rotation[..., 1]
    both = [_cluster(positions, f"{side}_thigh") for side in SIGN]
    if both[0] is None or both[1] is None:
        return None
    return both[0].mean(1) - both[1].mean(1)


def _turned(axis: np.ndarray, towards: np.ndarray) -> np.ndarray:
    """`axis` (frames, 3) in the sense that mostly points `towards`."""
    return axis if middle((axis * towards).sum(-1)) >= 0 else -axis


def _moving(joint: FunctionalJoint, side: str, name: str) -> FunctionalJoint:
    """`joint`, if it moves enough to be found."""
    if joint.swings[1] < _MOVES[name]:
        raise GapError(
            f"the {side} {name} turns by {np.degrees(joint.swings[1]):.1f} degrees rms, too little to tell where it is "
            "from clusters: they need a trial in which the joints move, such as a walk"
        )
    return joint


def _hips(positions, limbs: dict[str, _Limb]) -> tuple[dict[str, np.ndarray], Segment | None]:
    """Both hips, and the pelvis, from the pelvis' cluster; none without it or without one of the thighs."""
    markers = _cluster(positions, "pelvis")
    cluster = None if markers is None else cluster_pose(markers)
    if cluster is None or len(limbs) < len(SIGN):
        return {}, None
    joints, inside = {}, lambda v: np.array([middle(x) for x in np.einsum("tji,tj->ti", cluster.rotation, v).T])
    for side, limb in limbs.items():
        joint = _moving(functional_joint(cluster, limb.thigh), side, "hip")
        joints[side] = joint if joint.swings[2] > _BALL else functional_joint(cluster, limb.thigh, hinge=True)
    thighs = {side: limb.thigh.origin for side, limb in limbs.items()}
    axes = {side: _turned(joint.axis, thighs["left"] - thighs["right"]) for side, joint in joints.items()}
    left = unit(inside(axes["left"]) + inside(axes["right"]))
    midline = inside(0.5 * (thighs["left"] + thighs["right"]) - cluster.origin) @ left
    hips = {}
    for side, joint in joints.items():
        hips[side] = joint.centre
        if joint.swings[2] <= _BALL:
            half = _HALF_PELVIS * middle(np.linalg.norm(joint.centre - limbs[side].knee.centre, axis=-1))
            short = midline + SIGN[side] * half - inside(joint.centre - cluster.origin) @ left
            hips[side] = joint.centre + short / (inside(axes[side]) @ left) * axes[side]
    up = inside(np.broadcast_to([0.0, 0.0, 1.0], cluster.origin.shape))
    turn = cluster.rotation @ _tilted(inside(hips["left"] - hips["right"]), up)
    return hips, Segment(0.5 * (hips["left"] + hips["right"]), turn)


def _tilted(across: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Rotation (3, 3) of a pelvis with y along `across` (3,), tilted forwards as usual where the trunk's z is `up`."""
    y = unit(across)
    x = unit(np.cross(y, up))
    c, s = np.cos(NEUTRAL_TILT), np.sin(NEUTRAL_TILT)
    tilt = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    return np.stack([x, y, np.cross(x, y)], axis=-1) @ tilt


def _below(positions, side: str, limb: _Limb, hip: np.ndarray) -> dict[str, np.ndarray]:
    """Knee and ankle of a leg, with a point on the lateral side of the knee's axis.

    Distances along the leg are from the hip, and those outwards are along the knee's axis, from the knee's centre as it
    was found.
    """
    ankle = _ankle(positions, side, limb)
    out = lambda point: middle(((point - limb.knee.centre) * limb.outward).sum(-1))
    up = _lengthwise(hip - limb.knee.centre, limb.outward)
    length = middle(((hip - limb.knee.centre) * up).sum(-1))
    places = [(length, "thigh", -up)]
    if ankle is not None:
        places.append((length, "shank", _lengthwise(ankle.centre - limb.knee.centre, limb.outward)))
    rows = []
    for start, name, down in places:
        marker = max(np.moveaxis(limb.markers[name], 1, 0), key=out)
        along = start + middle(((marker - limb.knee.centre) * down).sum(-1))
        rows.append((along, out(marker) - _THICK[name] * length - out(hip)))
    far, off = np.array(rows).T
    slope = far @ off / (far @ far)
    knee = limb.knee.centre + (out(hip) + slope * length) * limb.outward
    found = {f"{side}_knee": knee, f"{side}_knee_lateral": knee + _LEVER * limb.outward}
    if ankle is not None:
        full = length + middle(((ankle.centre - limb.knee.centre) * places[1][2]).sum(-1))
        axis = _turned(ankle.axis, limb.outward)
        short = out(hip) + slope * full - out(ankle.centre)
        found[f"{side}_ankle"] = ankle.centre + short / middle((axis * limb.outward).sum(-1)) * axis
    return found


def _lengthwise(line: np.ndarray, outward: np.ndarray) -> np.ndarray:
    """Direction (frames, 3) of a limb, seen from the side."""
    return unit(line - outward * (line * outward).sum(-1, keepdims=True))


def _ankle(positions, side: str, limb: _Limb) -> FunctionalJoint | None:
    """The ankle as a hinge between shank and foot; None without a foot, or if it hardly moves, as in an orthosis.

    Feet aren't rigid, and their markers are nearly on a line. So a foot is taken to turn against the shank about the
    knee's axis only: a point on its side, along that axis, is added to the markers.
    """
    names = [f"{side}_{name}" for name in _FOOT if f"{side}_{name}" in positions]
    foot = _cluster(positions, f"{side}_foot")
    if foot is None and len(names) > 1:
        foot = np.stack([positions[name] for name in names], axis=1)
    if foot is None:
        return None
    beside = foot.mean(1) + _LEVER * limb.outward
    pose = cluster_pose(np.concatenate([foot, beside[:, None]], axis=1))
    if pose is None:
        return None
    joint = functional_joint(limb.shank, pose, hinge=True)
    return joint if joint.swings[1] > _MOVES["ankle"] else None
