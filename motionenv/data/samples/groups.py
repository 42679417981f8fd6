"""All samples of one group of walkers: their motion, their cameras and who passes by."""

import numpy as np

from motionenv.data.samples.passers import Passers
from motionenv.data.samples.views import place
from motionenv.data.samples.walkers import (
    VIEW,
    WALKERS,
    frames_of,
    generator,
    joints_in,
    mean_heading,
    record,
    shown,
    turned,
)
from motionenv.data.specification import Specification


class Group:
    """The samples of one group of walkers: motion and cameras of them all, without pictures.

    Attributes:
        poses, joints: (n, frames, 25) and (n, frames, 15, 3) [m, rad] in each sample's world.
        offsets, radii, heights: of the bodies, (n, 16, 3), (n, limbs, 2) and (n,) [m].
        phase, contact: (n, frames) and (n, frames, 2).
        views: the cameras.
        passers: people who pass by.
    """

    def __init__(self, spec: Specification, number: int) -> None:
        self.spec, self.number, n = spec, number, WALKERS * spec.people.views
        rng, recordings = generator(spec.seed, number, VIEW), record(spec, number)
        who = np.arange(n) % WALKERS
        frames = rng.integers(*frames_of(spec)[1:], n, endpoint=True)[:, None] + np.arange(spec.clip)
        self.poses, self.offsets, self.radii, self.heights = shown(recordings, who, frames)
        self.phase = np.stack([r.phase for r in recordings])[who[:, None], frames]
        self.contact = np.stack([r.contact for r in recordings])[who[:, None], frames]
        turned(self.poses, -mean_heading(self.poses))
        self.poses[:, :, :2] -= self.poses[:, :1, :2].copy()
        self.joints = joints_in(self.poses, self.offsets)
        self.views = place(spec, self.joints, self.heights, rng)
        self.passers = Passers(spec, number, self.joints, self.views)
