"""Samples of a data set: pictures and exact truth, a function of the specification, its seed and an index alone.

A sample is a dict of arrays, by the names in `Output.fields`:

    rgb         (frames, height, width, 3) uint8
    mask        (frames, height, width) uint8: 255 where the walker is seen
    limbs       (frames, height, width) uint8: 1 + index into `motionenv.body.LIMBS` of anybody's limb; 0 elsewhere
    people      (frames, height, width) uint8: 1 the walker, 2 and more the passers-by; 0 elsewhere
    depth       (frames, height, width) float32 [m] along the camera's z, at most `FAR`, which is the background's
    poses       (frames, 25) of the walker [m, rad]
    joints      (frames, 15, 3) [m] in the world, ordered as `motionenv.types.MARKERS`
    pixels      (frames, 15, 2) of the joints; NaN behind the camera
    visibility  (frames, 15) uint8, as in COCO: 0 outside the picture, 1 hidden, 2 seen
    detected    (frames, 15, 3) pixels and confidence as a detector of keypoints gives them; NaN where it gives none
    phase       (frames,) [cycles]; see `motionenv.data.samples.walkers.RecordedWalk`
    contact     (frames, 2) bool: left and right foot on the ground
    body        `offsets` (16, 3) and `radii` (limbs, 2) [m] of the walker's `Skeleton`, and its `height` [m]
    camera      `K` (3, 3) [pixels], `R` (3, 3), and `t` (frames, 3) [m]: world → camera, as in OpenCV
    face        (frames, 5, 3) of `motionenv.body.face.FACE`: pixels, and visibility as above
    others      `others_poses`, `others_joints`, `others_pixels`, `others_visibility` and `others_face` of the
                passers-by, with an axis for them first, as long as there may be at most; NaN and 0 for fewer

All samples have `index`, and `walker`, a number of who walks that nobody else has, also with another seed. The axis of
frames is missing from single pictures. The world's origin is on the ground below the pelvis in the first frame, and x
the walker's mean heading.
"""

import zlib
from collections import OrderedDict
from collections.abc import Iterator

import numpy as np

from motionenv.data.samples.drawing import Drawing
from motionenv.data.samples.groups import Group
from motionenv.data.samples.views import visibility
from motionenv.data.samples.walkers import DETECTOR, WALKERS, generator
from motionenv.data.specification import PICTURES, Specification
from motionenv.mocap.keypoints.detector_errors import DetectorErrors
from motionenv.types import Points

Sample = dict[str, np.ndarray]

_PIXELS = 1 << 22  # of the pictures that are drawn together
_GROUPS = 2  # kept, for whoever asks for samples in turn
# Fields with an axis of frames, and those that have one for the passers-by before it.
_TIMED = {*PICTURES, "poses", "joints", "pixels", "visibility", "detected", "phase", "contact", "t", "face"}
_OTHERS = {"others_poses", "others_joints", "others_pixels", "others_visibility", "others_face"}


class Sampler:
    """Makes the samples of a specification, in any order; one for each process.

    Args:
        spec: the specification.
    """

    def __init__(self, spec: Specification) -> None:
        self.spec = spec
        self.per_group = WALKERS * spec.people.views
        # Other people are drawn with another seed, or other wishes: the numbers of a sort of people begin elsewhere.
        self._first = zlib.crc32(f"{spec.seed} {spec.people.model_dump_json()}".encode()) << 21
        self._groups: OrderedDict[int, Group] = OrderedDict()
        wanted = set(spec.output.fields)
        self._wanted = wanted
        seen = {*PICTURES, "visibility", "face"} | ({"others"} if spec.people.passers_by[1] else set())
        self._drawing = Drawing(spec, rgb="rgb" in wanted) if wanted & seen else None

    def samples(self, start: int, stop: int) -> Iterator[Sample]:
        """The samples of indices `start` to `stop`, in order, each drawn when it is asked for or shortly before."""
        most = max(1, _PIXELS // (self.spec.clip * self.spec.pictures.width * self.spec.pictures.height))
        most = most if self._drawing is not None else self.per_group
        while start < stop:
            number, first = divmod(start, self.per_group)
            last = min(first + most, self.per_group, first + stop - start)
            yield from self._made(self._group(number), np.arange(first, last))
            start += last - first

    def sample(self, index: int) -> Sample:
        """The sample of an `index`, from 0; see the module."""
        return next(self.samples(index, index + 1))

    def _group(self, number: int) -> Group:
        if number not in self._groups:
            self._groups[number] = Group(self.spec, self.spec.first_group + number)
            while len(self._groups) > _GROUPS:
                self._groups.popitem(last=False)
        return self._groups[number]

    def _made(self, group: Group, which: np.ndarray) -> Iterator[Sample]:
        found = self._truth(group, which)
        if self._drawing is not None:
            found |= self._seen(group, which, self._drawing.draw(group, which))
        if self.spec.clip == 1:  # single pictures have no axis of frames
            found = {n: v[:, :, 0] if n in _OTHERS else v[:, 0] if n in _TIMED else v for n, v in found.items()}
        first = (group.number - self.spec.first_group) * self.per_group
        for k, j in enumerate(which.tolist()):
            walker = self._first + group.number * WALKERS + j % WALKERS
            sample = {"index": np.array(first + j), "walker": np.array(walker)}
            sample |= {name: values[k] for name, values in found.items()}
            yield sample

    def _seen(self, group: Group, which: np.ndarray, drawn: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """The pictures `drawn` of samples `which`, and what takes them to be known."""
        found = {name: drawn[name] for name in PICTURES if name in self._wanted}
        if "visibility" in self._wanted:
            joints = group.views.project(group.joints[which], which)
            found["visibility"] = visibility(*joints, drawn, 1)
        if "face" in self._wanted:
            found["face"] = group.face(which, drawn)
        if "others" in self._wanted:
            found |= group.passers.truth(which, drawn)
        return found

    def _truth(self, group: Group, which: np.ndarray) -> dict[str, np.ndarray]:
        """Truth that needs no pictures of samples `which`, with an axis for them first."""
        views, wanted = group.views, self._wanted
        pixels, depth = views.project(group.joints[which], which)
        pixels[depth <= 0] = np.nan
        known = {
            "poses": group.poses[which], "joints": group.joints[which], "pixels": pixels, "phase": group.phase[which],
            "contact": group.contact[which],
        }  # fmt: skip
        found = {name: values for name, values in known.items() if name in wanted}
        if "detected" in wanted:
            found["detected"] = self._detected(group, which, pixels)
        if "body" in wanted:
            found |= {"offsets": group.offsets[which], "radii": group.radii[which], "height": group.heights[which]}
        if "camera" in wanted:
            found |= {"K": views.K[which], "R": views.R[which], "t": views.t[which]}
        return found

    def _detected(self, group: Group, which: np.ndarray, pixels: np.ndarray) -> np.ndarray:
        """The points (k, frames, 15, 3) as a detector gives them, from each sample's own random numbers."""
        found = np.full((*pixels.shape[:3], 3), np.nan)
        for k, j in enumerate(which.tolist()):
            rng = generator(self.spec.seed, group.number * self.per_group + j, DETECTOR)
            seen = DetectorErrors().apply(Points(pixels[k], self.spec.fps, "px"), rng)
            found[k, ..., :2], found[k, ..., 2] = seen.positions, seen.confidence
        return found
