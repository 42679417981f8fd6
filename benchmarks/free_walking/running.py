"""Runners from published joint angles, for training: no capture that may ship shows anybody who runs.

Angles of hip and knee over the cycle follow Novacheck (1998), "The biomechanics of running", Gait & Posture 7, figure
6, from jogging to sprinting; arms swing against the legs with bent elbows. Amplitudes, timing and posture vary by more
than people do, so that whoever learns from them isn't tied to one style.
"""

import math

import numpy as np
from scipy.interpolate import CubicSpline

from motionenv.types import POSE

_GRAVITY = 9.81
_AT = {name: i for i, name in enumerate(POSE)}


def run(rng: np.random.Generator, seconds: float, fps: float) -> np.ndarray:
    """Poses (frames, 25) [m, rad] of somebody who runs along a curved path, the pelvis's height about 0."""
    time = np.arange(round(seconds * fps)) / fps
    sprint = rng.uniform(0, 1)  # from jogging to sprinting
    speed = 1.6 + 3.4 * sprint + rng.normal(0, 0.3)
    phase = rng.uniform(0, 1) + time * (1.25 + 0.45 * sprint + rng.normal(0, 0.08))
    poses = np.zeros((len(time), len(POSE)))
    stance = 0.40 - 0.12 * sprint + rng.normal(0, 0.02)
    hip, knee = _leg(rng, sprint, stance)
    shoulder = CubicSpline([0, 0.25, 0.5, 0.75, 1], _closed(rng, [-38, -5, 25, 2], 6 + 4 * sprint), bc_type="periodic")
    elbow, lean = rng.uniform(1.0, 2.0), rng.uniform(0.0, 0.35)
    for side, shift in (("left", 0.0), ("right", 0.5)):
        at = (phase + shift) % 1
        poses[:, _AT[f"{side}_hip_flexion"]] = hip(at) + lean
        poses[:, _AT[f"{side}_knee_flexion"]] = np.maximum(knee(at), 0.02)
        swing = shoulder(at)
        poses[:, _AT[f"{side}_shoulder_flexion"]] = swing
        poses[:, _AT[f"{side}_elbow_flexion"]] = elbow + rng.uniform(0, 0.6) * swing
        poses[:, _AT[f"{side}_shoulder_abduction"]] = rng.uniform(0.05, 0.5)
        poses[:, _AT[f"{side}_shoulder_rotation"]] = rng.uniform(-0.2, 0.8)
    turning = _wander(rng, time, 0.9)
    heading = rng.uniform(-math.pi, math.pi) + np.cumsum(turning) / fps
    poses[:, :2] = np.cumsum(speed * np.column_stack([np.cos(heading), np.sin(heading)]), axis=0) / fps
    poses[:, 2] = -rng.uniform(0.025, 0.05) * np.cos(4 * math.pi * (phase - 0.4 * stance))
    poses[:, _AT["root_tilt"]] = lean
    poses[:, _AT["root_obliquity"]] = -np.arctan(speed * turning / _GRAVITY)
    poses[:, _AT["root_heading"]] = heading + rng.uniform(0, 0.15) * np.sin(2 * math.pi * phase)
    return poses


def _leg(rng: np.random.Generator, sprint: float, stance: float) -> tuple[CubicSpline, CubicSpline]:
    """Hip and knee flexion [rad] over the cycle from initial contact."""
    off = stance
    hip = [38 + 8 * sprint, 20 + 8 * sprint, -6, 20 + 10 * sprint, 46 + 22 * sprint, 44 + 14 * sprint]
    knee = [20, 42, 18, 85 + 40 * sprint, 60 + 25 * sprint, 22]
    at = [0, 0.45 * off, off + 0.02, off + 0.62 * (0.72 - off), 0.78, 0.92, 1]
    swing = [0, 0.45 * off, off, off + 0.5 * (1 - off), off + 0.75 * (1 - off), 0.93, 1]
    return (
        CubicSpline(at, _closed(rng, hip, 5), bc_type="periodic"),
        CubicSpline(swing, _closed(rng, knee, 6), bc_type="periodic"),
    )


def _closed(rng: np.random.Generator, degrees: list[float], spread: float) -> np.ndarray:
    """Values of a periodic curve [rad], varied by a standard deviation of `spread` degrees."""
    varied = np.asarray(degrees) * rng.uniform(0.8, 1.15) + rng.normal(0, spread, len(degrees))
    return np.radians([*varied, varied[0]])


def _wander(rng: np.random.Generator, time: np.ndarray, spread: float) -> np.ndarray:
    """A smooth random course (frames,) with standard deviation `spread`, or constant, or zero."""
    kind = rng.uniform()
    if kind < 0.4:
        return np.zeros_like(time)
    if kind < 0.7:
        return np.full_like(time, rng.normal(0, spread))
    knots = np.arange(0, time[-1] + 4, 1.0)
    return np.interp(time, knots, rng.normal(0, spread, len(knots)))
