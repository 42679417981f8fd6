"""The points from which gait events and steps are measured: heels, toes and the pelvis."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.signal import butter, filtfilt

from motionenv._core.representation import OneLine
from motionenv.body.gaps import listed
from motionenv.body.kinematics import forward
from motionenv.body.limbs import LIMB_SHIFTS, LIMBS, limb_radii
from motionenv.body.skeleton import NODES, SEGMENTS
from motionenv.errors import GapError
from motionenv.mocap.marker_sets import MarkerMap, find_landmarks
from motionenv.mocap.retargeting import find_nodes
from motionenv.types import Markers, Motion

# Heel and toe of the body in the foot's frame, from the ankle, relative to stature: the ends of its drawn foot.
_FOOT = LIMBS.index("left_foot")
_HEEL, _TOE = LIMB_SHIFTS[_FOOT] + np.outer([-1.0, 1.0] * limb_radii(1.0)[_FOOT], [1.0, 0.0, 0.0])


@dataclass(frozen=True, eq=False, repr=False)
class Feet(OneLine):
    """Heels, toes and the `pelvis`, midway between the hips, over time, each (frames, 3) [m], NaN in gaps.

    `heel` and `toe` are by side, without sides that the capture doesn't show; `fps` is the frame rate [Hz]; `notes`
    tell what stands in for a heel or a toe that the capture doesn't show.
    """

    pelvis: np.ndarray
    heel: dict[str, np.ndarray]
    toe: dict[str, np.ndarray]
    fps: float
    notes: tuple[str, ...] = ()

    @property
    def sides(self) -> tuple[str, ...]:
        """The sides that the capture shows."""
        return tuple(side for side in ("left", "right") if side in self.heel and side in self.toe)


def feet_of(capture: Markers | Motion, marker_map: MarkerMap | str | None = None) -> Feet:
    """Heels, toes and pelvis of markers (frames, points, 3), or of a motion (frames, 25).

    Where there is no marker on a heel, the ankle stands in for it; where there is none on a toe, the metatarsal heads
    do, or else the ankle. Without a `marker_map` of the `capture`'s points, the marker set is recognised.

    Raises:
        GapError: no foot, or no pelvis.
        MotionError: as in `motionenv.retarget`.
    """
    if isinstance(capture, Motion):
        return _of_motion(capture)
    landmarks = find_landmarks(capture, marker_map)
    at = landmarks.positions
    nodes = find_nodes(capture, marker_map=marker_map).positions
    pelvis = nodes[:, NODES.index("pelvis")]
    if not np.isfinite(pelvis).any():
        raise GapError(f"{capture.name or 'this capture'} never shows both hips, so steps can't be measured")
    heel, toe = {}, {}
    stands: dict[str, list[str]] = {}
    for side in ("left", "right"):
        ankle = nodes[:, NODES.index(f"{side}_ankle")]
        if not np.isfinite(ankle).any() and not {f"{side}_heel", f"{side}_toe"} <= at.keys():
            continue
        heel[side] = _first(at, side, ("heel",), ankle, stands)
        toe[side] = _first(at, side, ("toe", "metatarsal_5", "metatarsal_1"), ankle, stands)
    if not heel:
        raise GapError(f"{capture.name or 'this capture'} shows no ankle, so steps can't be measured")
    notes = [f"{name} stands in for {listed(places)}, where no marker is" for name, places in stands.items()]
    return Feet(pelvis, heel, toe, capture.fps, (*landmarks.notes, *notes))


def _first(at, side: str, names: tuple[str, ...], ankle: np.ndarray, stands: dict[str, list[str]]) -> np.ndarray:
    """The first of the landmarks that the capture shows, or the ankle; `stands` gets what it stands in for."""
    for name in names:
        if f"{side}_{name}" in at:
            if name != names[0]:
                stands.setdefault(name, []).append(f"{side} {names[0]}")
            return at[f"{side}_{name}"]
    stands.setdefault("the ankle", []).append(f"{side} {names[0]}")
    return ankle


def _of_motion(motion: Motion) -> Feet:
    """Heels and toes of the body's drawn feet."""
    if motion.poses.ndim != 2:
        raise GapError(f"steps are measured in one motion (frames, 25), got {motion.poses.shape}")
    nodes, turns = forward(motion.poses, motion.skeleton)
    heel, toe = {}, {}
    for side in ("left", "right"):
        ankle, turn = nodes[:, NODES.index(f"{side}_ankle")], turns[:, SEGMENTS.index(f"{side}_foot")]
        if np.isfinite(ankle).any():
            heel[side] = ankle + turn @ _HEEL * motion.skeleton.height
            toe[side] = ankle + turn @ _TOE * motion.skeleton.height
    if not heel:
        raise GapError(f"{motion.name or 'this motion'} has no leg, so steps can't be measured")
    return Feet(nodes[:, NODES.index("pelvis")], heel, toe, motion.fps)


_ORDER = 2  # of the Butterworth filter, applied forwards and backwards


@cache
def _low_pass(cutoff: float) -> tuple[np.ndarray, np.ndarray]:
    """The filter of a cut-off frequency relative to half the frame rate."""
    return butter(_ORDER, cutoff)


def bridged(path: np.ndarray) -> np.ndarray:
    """`path` (frames, n) with gaps filled linearly, and the ends held; NaN if nothing is known."""
    known = np.isfinite(path).all(-1)
    if not known.any():
        return path
    frames = np.arange(len(path))
    return np.stack([np.interp(frames, frames[known], column[known]) for column in path.T], -1)


def smoothed(path: np.ndarray, fps: float, cutoff: float) -> np.ndarray:
    """`path` (frames, n) with gaps bridged, low-pass filtered without delay.

    At the frequency `cutoff` [Hz] the amplitude is halved; above 0.45 of the frame rate `fps` [Hz] nothing is filtered.
    """
    path = bridged(path)
    if cutoff >= 0.45 * fps or len(path) < 10:
        return path
    b, a = _low_pass(cutoff / (fps / 2))
    # Straight paths pass unchanged, and two periods of the cut-off at either end let the filter settle.
    trend = np.linspace(path[0], path[-1], len(path))
    return trend + filtfilt(b, a, path - trend, axis=0, padlen=min(round(2 * fps / cutoff), len(path) - 1))
