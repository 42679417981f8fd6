"""The samples of one group of walkers: their motion, their cameras and who passes by."""

import numpy as np

from motionenv.body import LIMBS
from motionenv.body.face import face_points
from motionenv.data.samples import walkers
from motionenv.data.samples.views import Views, face_visibility, place, visibility
from motionenv.data.specification import Specification
from motionenv.types import Skeleton


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
        self.spec, self.number, n = spec, number, walkers.WALKERS * spec.people.views
        rng, recordings = walkers.generator(spec.seed, number, walkers.VIEW), walkers.record(spec, number)
        who = np.arange(n) % walkers.WALKERS
        frames = rng.integers(*walkers.frames_of(spec)[1:], n, endpoint=True)[:, None] + np.arange(spec.clip)
        self.poses, self.offsets, self.radii, self.heights = walkers.shown(recordings, who, frames)
        self.phase = np.stack([r.phase for r in recordings])[who[:, None], frames]
        self.contact = np.stack([r.contact for r in recordings])[who[:, None], frames]
        walkers.turned(self.poses, -walkers.mean_heading(self.poses))
        self.poses[:, :, :2] -= self.poses[:, :1, :2].copy()
        self.joints = walkers.joints_in(self.poses, self.offsets)
        self.views = place(spec, self.joints, self.heights, rng)
        self.passers = Passers(spec, number, self.joints, self.views)

    def face(self, which: np.ndarray, drawn: dict[str, np.ndarray]) -> np.ndarray:
        """`face` of samples `which` (k,), whose pictures are `drawn`: (k, frames, 5, 3)."""
        body = [self.offsets[which], self.radii[which], self.heights[which]]
        return _face(self.views, which, self.poses[which], body, drawn)


def _face(views: Views, which: np.ndarray, poses: np.ndarray, body: list, drawn: dict[str, np.ndarray]) -> np.ndarray:
    """Pixels and visibility (k, frames, 5, 3) of the faces of people with `poses` (k, frames, 25)."""
    points = np.array([face_points(p, Skeleton(*one)) for p, *one in zip(poses, *body, strict=True)])
    pixels, depth = views.project(points, which)
    pixels[depth <= 0] = np.nan
    return np.concatenate([pixels, face_visibility(pixels, depth, drawn)[..., None]], axis=-1)


_DEPTHS = (0.45, 2.2)  # of the walker's, between which they pass in the middle of the clip
_WIDE = 0.55  # picture widths from the middle at which they pass
_APART = 0.6  # [m] least distance between two people's pelves
_NEAREST = 0.6  # [m] least depth of a passer-by's joints


class Passers:
    """Up to m passers-by in each of a group's n samples.

    Attributes:
        poses, joints: (m, n, frames, 25) and (m, n, frames, 15, 3) [m, rad].
        offsets, radii, heights: of the bodies, (m, n, 16, 3), (m, n, limbs, 2) and (m, n) [m].
        present: (m, n) whether there is one.
    """

    def __init__(self, spec: Specification, number: int, joints: np.ndarray, views: Views) -> None:
        self.views, most = views, spec.people.passers_by[1]
        n, frames = joints.shape[:2]
        self.present = np.zeros((most, n), bool)
        self.poses, self.joints = np.full((most, n, frames, 25), np.nan), np.full((most, n, frames, 15, 3), np.nan)
        self.offsets, self.radii = np.zeros((most, n, 16, 3)), np.zeros((most, n, len(LIMBS), 2))
        self.heights = np.ones((most, n))
        if not most:
            return
        rng = walkers.generator(spec.seed, number, walkers.PASSERS)
        recordings = walkers.record(spec, number, walkers.PASSERS)
        least, limit = (int(count) for count in spec.people.passers_by)
        counts = rng.integers(least, limit, n, endpoint=True)
        taken = [joints[:, :, walkers.PELVIS, :2]]
        for k in range(most):
            who = rng.integers(walkers.WALKERS, size=n)
            start = rng.integers(*walkers.frames_of(spec)[1:], n, endpoint=True)
            poses, *body = walkers.shown(recordings, np.asarray(who), start[:, None] + np.arange(frames))
            self._lead(poses, joints, rng, spec.pictures.width)
            self.joints[k] = walkers.joints_in(poses, body[0])
            free = (views.project(self.joints[k])[1] > _NEAREST).all(axis=(1, 2))
            for other in taken:
                apart = np.linalg.norm(poses[..., :2] - other, axis=-1)
                free &= ~(apart < _APART).any(axis=1)
            self.present[k] = (k < counts) & free
            self.poses[k], self.offsets[k], self.radii[k], self.heights[k] = poses, *body
            self.poses[k, ~self.present[k]] = np.nan
            self.joints[k, ~self.present[k]] = np.nan
            taken.append(self.poses[k, ..., :2])

    def _lead(self, poses: np.ndarray, joints: np.ndarray, rng: np.random.Generator, width: int) -> None:
        """Move walks (n, frames, 25) in place so that they pass the camera's view in the middle of the clip."""
        views, n, middle = self.views, len(poses), poses.shape[1] // 2
        walkers.turned(poses, rng.uniform(-np.pi, np.pi, n) - walkers.mean_heading(poses))
        centre = -np.einsum("nji,nj->ni", views.R, views.t[:, middle])[:, :2]
        away = np.linalg.norm(joints[:, middle, walkers.PELVIS, :2] - centre, axis=-1)
        forward = views.R[:, 2, :2] / np.linalg.norm(views.R[:, 2, :2], axis=-1, keepdims=True)
        depth = away * np.exp(rng.uniform(np.log(_DEPTHS[0]), np.log(_DEPTHS[1]), n))
        aside = depth * width / views.K[:, 0, 0] * rng.uniform(-_WIDE, _WIDE, n)
        place = centre + depth[:, None] * forward + aside[:, None] * views.R[:, 0, :2]
        poses[..., :2] += (place - poses[:, middle, :2])[:, None]

    def truth(self, which: np.ndarray, drawn: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """`others_...` of samples `which` (k,), whose pictures are `drawn`."""
        most, _, frames = self.poses.shape[:3]
        pixels, seen = np.zeros((len(which), most, frames, 15, 2)), np.zeros((len(which), most, frames, 15), np.uint8)
        for k in range(most):
            pixels[:, k], depth = self.views.project(self.joints[k, which], which)
            seen[:, k] = visibility(pixels[:, k], depth, drawn, k + 2)
        everybody = (part[:, which] for part in (self.poses, self.offsets, self.radii, self.heights))
        faces = [_face(self.views, which, poses, body, drawn) for poses, *body in zip(*everybody, strict=True)]
        return {
            "others_poses": self.poses[:, which].swapaxes(0, 1), "others_joints": self.joints[:, which].swapaxes(0, 1),
            "others_pixels": pixels, "others_visibility": seen,
            "others_face": np.stack(faces, axis=1) if faces else np.zeros((len(which), 0, frames, 5, 3)),
        }  # fmt: skip
