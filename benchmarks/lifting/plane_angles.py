"""Peers that take angles, contacts and speed in the picture's plane: myogait (MIT), and a dozen lines."""

import logging
from dataclasses import dataclass, field

import numpy as np
from scipy.signal import find_peaks

from motionenv.gait.feet import smoothed
from motionenv.types import MARKERS, Event, Points

_M = {name: i for i, name in enumerate(MARKERS)}
_CUTOFF, _STEP, _SWING = 6.0, 0.35, 0.1  # [Hz], [s], and a share of the trunk's length


@dataclass(frozen=True, eq=False)
class Estimate:
    """Angles [degrees] (frames,) by name, contacts, and means over strides: `speed`, `step_length`, `cadence`.

    `deviations` are the angles' by name, where a method tells them.
    """

    angles: dict[str, np.ndarray]
    events: tuple[Event, ...]
    parameters: dict[str, float] = field(default_factory=dict)
    deviations: dict[str, np.ndarray] = field(default_factory=dict)


def in_the_plane(points: Points, feet: np.ndarray | None, height: float) -> Estimate:
    """Directions of limbs in the picture after a low-pass filter; contacts of ankles that are furthest ahead (Zeni)."""
    at = {name: smoothed(points.positions[:, i], points.fps, _CUTOFF) for name, i in _M.items()}
    at |= {} if feet is None else {
        f"{side}_{part}": smoothed(feet[:, 2 * i + k], points.fps, _CUTOFF)
        for i, side in enumerate(("left", "right")) for k, part in enumerate(("heel", "toe"))
    }  # fmt: skip
    hips = 0.5 * (at["left_hip"] + at["right_hip"])
    ahead = np.sign(hips[-1, 0] - hips[0, 0])
    pitch = lambda line: np.degrees(np.arctan2(ahead * line[:, 0], line[:, 1]))  # of a line downwards
    trunk = pitch(hips - 0.5 * (at["left_shoulder"] + at["right_shoulder"]))
    angles, events = {f"{side}_trunk_tilt": -trunk for side in ("left", "right")}, []
    for side in ("left", "right"):
        hip, knee, ankle = (at[f"{side}_{joint}"] for joint in ("hip", "knee", "ankle"))
        thigh, shank = pitch(knee - hip), pitch(ankle - knee)
        angles |= {f"{side}_hip_flexion": thigh - trunk, f"{side}_knee_flexion": thigh - shank}
        if feet is not None:
            angles[f"{side}_ankle_dorsiflexion"] = pitch(at[f"{side}_toe"] - at[f"{side}_heel"]) - 90 - shank
        least = _SWING * np.median(np.abs(at["sternum"] - hips)[:, 1])
        found = find_peaks(ahead * (ankle - hips)[:, 0], distance=round(_STEP * points.fps), prominence=least)[0]
        events += [Event(k / points.fps, "initial_contact", side) for k in found]
    return Estimate(angles, tuple(events), _by_height(points, hips, events, height))


def _by_height(points: Points, hips: np.ndarray, events: list[Event], height: float) -> dict[str, float]:
    """Speed, step length and cadence of somebody `height` tall who crosses the picture."""
    ankles = points.positions[:, [_M["left_ankle"], _M["right_ankle"]], 1].mean(axis=1)
    tall = np.nanmedian(ankles - points.positions[:, _M["head"], 1]) / (0.896 * height)  # pixels per metre
    speed = abs(hips[-1, 0] - hips[0, 0]) / tall / ((len(hips) - 1) / points.fps)
    steps = np.diff(np.sort([event.time for event in events]))
    if not steps.sum() > 0:
        return {"speed": speed}
    return {"speed": speed, "step_length": speed * float(np.mean(steps)), "cadence": 60 / float(np.mean(steps))}


def myogait(points: Points, feet: np.ndarray | None, height: float, size: tuple[int, int]) -> Estimate:
    """Angles, events and speed by myogait's validated pipeline, from landmarks as MediaPipe gives them.

    Raises:
        ModuleNotFoundError: it isn't installed.
    """
    logging.getLogger("myogait").setLevel(logging.ERROR)
    from myogait.analysis import walking_speed
    from myogait.pipeline import run_pipeline

    ran = run_pipeline(_pivot(points, feet, size), analyze=False, show_progress=False)
    data = ran["data"]
    names = {"hip": "hip_flexion", "knee": "knee_flexion", "ankle": "ankle_dorsiflexion"}
    series = lambda key: np.array([f[key] if f[key] is not None else np.nan for f in data["angles"]["frames"]], float)
    angles = {
        f"{side}_{ours}": series(f"{theirs}_{letter}")
        for side, letter in (("left", "L"), ("right", "R"))
        for theirs, ours in names.items() if feet is not None or theirs != "ankle"
    } | {f"{side}_trunk_tilt": series("trunk_angle") for side in ("left", "right")}  # fmt: skip
    events = [
        Event(event["frame"] / points.fps, "initial_contact", side)
        for side in ("left", "right") for event in data["events"][f"{side}_hs"]
    ]  # fmt: skip
    found = walking_speed(data, ran["cycles"], height_m=height)["speed_mean"]
    steps = np.diff(np.sort([event.time for event in events]))
    told = {"speed": found or np.nan, "cadence": 60 / float(np.mean(steps)) if steps.sum() > 0 else np.nan}
    return Estimate(angles, tuple(events), told)


def _pivot(points: Points, feet: np.ndarray | None, size: tuple[int, int]) -> dict:
    """Points as myogait takes them: normalised landmarks by MediaPipe's names."""
    shown = {name.upper(): points.positions[:, i] for name, i in _M.items() if "_" in name}
    shown["NOSE"] = points.positions[:, _M["head"]]
    if feet is not None:
        shown |= {f"{s}_{p}": feet[:, 2 * i + k] for i, s in enumerate(("LEFT", "RIGHT"))
                  for k, p in enumerate(("HEEL", "FOOT_INDEX"))}  # fmt: skip
    frames = []
    for t in range(len(points.positions)):
        landmarks = {
            name: {"x": float(path[t, 0] / size[0]), "y": float(path[t, 1] / size[1]),
                   "visibility": float(np.isfinite(path[t]).all())} for name, path in shown.items()
        }  # fmt: skip
        frames.append({"frame_idx": t, "time_s": t / points.fps, "landmarks": landmarks, "confidence": 1.0})
    return {
        "meta": {"fps": points.fps, "width": size[0], "height": size[1], "n_frames": len(frames)},
        "extraction": {"model": "mediapipe" if feet is not None else "yolo"}, "frames": frames,
    }  # fmt: skip
