"""Feet that walk by construction: known steps, known events, no model of gait."""

from dataclasses import replace

import numpy as np

from motionenv.gait import Events, Feet
from motionenv.types import Event

STRIDE, WIDTH, FOOT = 1.4, 0.12, 0.2  # [m]
PERIOD = 1.1  # [s]


def walker(
    seconds=6.6, fps=100.0, *, stance=0.62, stride=STRIDE, period=PERIOD, width=WIDTH, sides=("left", "right")
) -> Feet:
    """Straight ahead along x: the right foot lands at 0, the left half a period later, each again after a period."""
    t = np.arange(round(seconds * fps)) / fps
    pelvis = np.stack([stride * (t / period + 0.25) - 0.32 * stride, 0 * t, 0 * t + 0.9], -1)
    heel, toe = {}, {}
    for side in sides:
        late, y = (0.5, width / 2) if side == "left" else (0.0, -width / 2)
        cycle = t / period - late
        lifted = 0.6 * stance
        x = stride * (late + _moved(cycle, lifted, 0.1, 0.14))
        swing = np.clip((cycle % 1 - lifted) / (1 - lifted), 0, 1)
        heel[side] = np.stack([x, y + 0 * t, 0.03 + 0.2 * swing * (1 - swing)], -1)
        x = FOOT + stride * (late + _moved(cycle, stance, 0.15, 0.3))
        toe[side] = np.stack([x, y + 0 * t, 0.03 + 0 * t], -1)
    return Feet(pelvis, heel, toe, fps)


def truth(seconds=6.6, *, stance=0.62, period=PERIOD, sides=("left", "right")) -> Events:
    """The events of `walker`."""
    found = []
    for side in sides:
        for n in range(-2, round(seconds / period) + 2):
            contact = (n + (0.5 if side == "left" else 0.0)) * period
            found += [Event(contact, "initial_contact", side), Event(contact + stance * period, "toe_off", side)]
    inside = [event for event in found if 0 < event.time < seconds]
    return Events(tuple(sorted(inside, key=lambda e: e.time)), {"file": len(inside)})


def moved(feet: Feet, change) -> Feet:
    """Every point put through `change`, (frames, 3) to (frames, 3)."""
    return replace(
        feet, pelvis=change(feet.pelvis), heel={s: change(p) for s, p in feet.heel.items()},
        toe={s: change(p) for s, p in feet.toe.items()},
    )  # fmt: skip


def on_belt(feet: Feet, speed: float) -> Feet:
    """The same walk as a treadmill shows it."""
    return moved(feet, lambda p: p - np.arange(len(p))[:, None] / feet.fps * [speed, 0, 0])


def around(radius: float):
    """For `moved`: bends the x axis to a circle, to the left."""

    def change(points):
        angle, r = points[:, 0] / radius, radius - points[:, 1]
        return np.stack([r * np.sin(angle), radius - r * np.cos(angle), points[:, 2]], -1)

    return change


def standing(seconds=2.0, fps=100.0, noise=0.002) -> Feet:
    """A person who stands, with some noise."""
    one = walker(seconds, fps)
    still = np.random.default_rng(0)
    return moved(one, lambda p: np.broadcast_to(p[:1], p.shape) + noise * still.standard_normal(p.shape))


def times(events, kind: str, side: str) -> np.ndarray:
    """Times [s] of one kind and side."""
    return np.array([e.time for e in events if (e.kind, e.side) == (kind, side)])


def _moved(cycle, starts: float, quick: float, slow: float) -> np.ndarray:
    """Strides covered: still until `starts` of each cycle; then speed rises and falls linearly, in these shares."""
    u = np.clip((cycle % 1 - starts) / (1 - starts), 0, 1)
    top = 1 / (1 - 0.5 * (quick + slow))
    rising = np.minimum(u, quick)
    falling = np.maximum(u - (1 - slow), 0)
    level = u - rising - falling
    return np.floor(cycle) + top * (rising**2 / (2 * quick) + level + falling - falling**2 / (2 * slow))
