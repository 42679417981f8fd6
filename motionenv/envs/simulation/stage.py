"""People in front of cameras: motion, bodies, clothes and views of n episodes, and their images."""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from motionenv._core.validation import checked_whole
from motionenv.body.limbs import COLOURS, LIMBS
from motionenv.envs.simulation.estimates import FAR as FARTHEST
from motionenv.envs.simulation.estimates import true_joints
from motionenv.envs.simulation.motion_sources import Source
from motionenv.envs.simulation.views import FOV, View
from motionenv.errors import MotionError
from motionenv.render.cameras import view as camera_view
from motionenv.render.raycast.multi_body import WORN, MultiBodyRaycaster, outfits
from motionenv.render.sensors.augmentation import FAR, Augmentation, Augmenter
from motionenv.render.sensors.marker_sensor import gap_chances
from motionenv.types import MARKERS, Camera, Frame, Skeleton

#: Least and greatest image side [pixels].
SIZES = (36, 256)
#: What can be observed: images, and the true joints, which make an environment fully observable.
SENSES = ("rgb", "mask", "depth", "joints")


class Stage:
    """n episodes: moving bodies, clothes, cameras and scenery.

    Args:
        n, threads: number of episodes, and of rendering threads.
        source, view: of the motion, and placement of people and cameras.
        size: side of the square images [pixels], as validated by `PictureSettings`.
        scenery: background, occluders, noise.
        clothes: whether colours are random or fixed.
        gaps, gap_seconds: fraction of the time that the camera shows nothing, and how long it does so on average [s].

    Attributes:
        time: (n,) current frame of each episode.
        poses: (n, frames, 25) [m, rad].
        offsets, radii, heights: of the bodies, (n, 16, 3), (n, limbs, 2) and (n,) [m].
        colours: (n, 5, 3) of `motionenv.render.raycast.multi_body.WORN`.
        K, R, t: intrinsics and extrinsics of the cameras, (n, 3, 3), (n, 3, 3), (n, 3).
        pan: (n, frames) [pixels] shift of the background to the left since the start.
        blank: (n, frames) bool, frames in which the camera shows nothing.
    """

    def __init__(
        self, n: int, source: Source, view: View, *, size: int, scenery: Augmentation, clothes: bool,
        threads: int | None, gaps: float = 0.0, gap_seconds: float = 0.3,
    ) -> None:  # fmt: skip
        n = checked_whole(n, "num_envs", 1)
        if not isinstance(clothes, bool):
            raise MotionError(f"clothes must be True or False, got {clothes!r}")
        self.n, self.source, self.view, self.size, self.clothes = n, source, view, size, clothes
        source.open()
        self._crowd = MultiBodyRaycaster(size, size, threads=threads)
        self._scenery = Augmenter(scenery, n, size, size, fps=source.fps, threads=threads)
        self.time = np.zeros(n, dtype=np.intp)
        self.poses, self.pan = np.zeros((n, source.frames, 25)), np.zeros((n, source.frames))
        self.blank, self._gaps = np.zeros((n, source.frames), bool), gaps
        self._chances = gap_chances(gaps, gap_seconds, source.fps)
        self.offsets, self.radii, self.heights = np.zeros((n, 16, 3)), np.zeros((n, len(LIMBS), 2)), np.ones(n)
        self.colours = np.tile(np.array([*COLOURS.values()]), (n, 1, 1))
        self.K = np.tile(camera_view(0.0, width=size, height=size, fov_degrees=FOV).K, (n, 1, 1))
        self.R, self.t = np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3))
        self._all = np.arange(n)
        self._depth, self._limbs = np.empty((n, size, size), np.float32), np.empty((n, size, size), np.uint8)

    def begin(self, slots: np.ndarray, rngs: Sequence[np.random.Generator]) -> None:
        """Draw new people for `slots` (k,), each with its generator of `rngs`."""
        recordings = self.source.open()
        for slot, rng in zip(slots.tolist(), rngs, strict=True):
            poses, body = recordings.draw(rng)
            self.poses[slot] = poses
            self.offsets[slot], self.radii[slot], self.heights[slot] = body.offsets, body.radii, body.height
            placed, focal = self.view.place(self.poses[slot], body, rng), float(self.K[slot, 0, 0])
            self.R[slot], self.t[slot] = placed.R, placed.t
            self.pan[slot] = placed.way * focal / placed.behind
            if self.clothes:
                self.colours[slot] = outfits(rng.random((len(WORN), 3)))
            self._scenery.begin(slot, rng, distance=placed.away, behind=placed.behind, focal=focal)
            if self._gaps:
                self._blind(slot, rng.random(self.source.frames))
        self.time[slots] = 0

    def _blind(self, slot: int, chance: np.ndarray) -> None:
        """Hide frames of `slot` in gaps, a Markov chain (Gilbert 1960) that begins in equilibrium."""
        begins, stays = self._chances
        hidden = False
        for frame, drawn in enumerate(chance):
            hidden = bool(drawn < (self._gaps if frame == 0 else stays if hidden else begins))
            self.blank[slot, frame] = hidden

    def now(self) -> np.ndarray:
        """The current pose of each walker (n, 25) [m, rad]."""
        return self.poses[self._all, self.time]

    def draw(self, slots: np.ndarray, *, rgb: bool = True, back: int = 0) -> Frame:
        """Render `slots` (k,), ascending, `back` frames before the current one, with colours if `rgb`.

        The next call overwrites depth and limbs of the result.
        """
        people = self.offsets, self.radii, self.heights, self.colours, self.K, self.R, self.t
        if len(slots) < self.n:
            people = tuple(array[slots] for array in people)
        picture = np.empty((len(slots), self.size, self.size, 3), np.uint8) if rgb else None
        canvas = Frame(picture, self._depth[: len(slots)], self._limbs[: len(slots)])
        time = self.time[slots] - back
        frame = self._crowd.render(self.poses[slots, time], *people, rgb=rgb, out=canvas)
        frame = self._scenery.compose(frame, time, self.pan[slots, time], slots)
        blank = self.blank[slots, time]
        frame.limbs[blank], frame.depth[blank] = 0, FAR
        if frame.rgb is not None:
            frame.rgb[blank] = 0
        return frame

    def joints(self, slots: np.ndarray) -> np.ndarray:
        """The true joints (k, 15, 3) [m] of the current frames of `slots` (k,)."""
        return true_joints(self.poses[slots, self.time[slots]], self.offsets[slots])

    def truth(self, slot: int) -> dict[str, Any]:
        """The true pose (25,), joints (15, 3) [m], camera and skeleton of the current frame of `slot`."""
        pose, joints = self.poses[slot, self.time[slot]].copy(), self.joints(np.array([slot]))[0]
        skeleton = Skeleton(self.offsets[slot], self.radii[slot], float(self.heights[slot]))
        return {"pose": pose, "joints": joints, "camera": self.camera(slot), "skeleton": skeleton}

    def close(self) -> None:
        """End the threads that draw."""
        self._crowd.close()
        self._scenery.close()

    def camera(self, slot: int) -> Camera:
        """The camera of the episode in `slot`, fixed in the frame of positions."""
        return Camera(self.K[slot], self.R[slot], self.t[slot], self.size, self.size)


class PictureSettings:
    """What is observed: an `observation` of `SENSES`, or several as a flat Dict; images are squares of `size` [pixels].

    Raises:
        MotionError: no such name or size, or a name given twice.
    """

    def __init__(self, observation: str | Sequence[str], size: int) -> None:
        size = checked_whole(size, "size", *SIZES, "pixels")
        if isinstance(observation, str):
            names = [observation]
        else:
            names = list(observation) if isinstance(observation, Sequence) else []
        if not names or any(name not in SENSES or names.count(name) > 1 for name in names):
            raise MotionError(
                f"observation must be one of {', '.join(SENSES)}, or several different ones, got {observation!r}"
            )
        known: dict[str, gymnasium.Space] = {
            "rgb": spaces.Box(0, 255, (size, size, 3), np.uint8),
            "mask": spaces.Box(0, 255, (size, size, 1), np.uint8),
            "depth": spaces.Box(0.0, FAR, (size, size, 1), np.float32),
            "joints": spaces.Box(-FARTHEST, FARTHEST, (len(MARKERS), 3), np.float32),
        }
        self.size = size
        self._names, self._alone = names, isinstance(observation, str)
        self.rgb = "rgb" in names
        self.space = known[names[0]] if self._alone else spaces.Dict({name: known[name] for name in names})

    def of(self, stage: Stage, slots: np.ndarray) -> np.ndarray | dict[str, np.ndarray]:
        """The observation of the current frames of `slots` (k,) of a `stage`."""
        frame = None if self._names == ["joints"] else stage.draw(slots, rgb=self.rgb)
        seen = {
            name: stage.joints(slots).astype(np.float32) if frame is None or name == "joints" else _SEEN[name](frame)
            for name in self._names
        }
        return seen[self._names[0]] if self._alone else seen

    def evidence(self, frame: Frame) -> dict[str, Any]:
        """The most informative part of a `frame` (1, size, size), as arguments of `SilhouetteLikelihood.observe`.

        Raises:
            MotionError: no image is observed.
        """
        name = next((name for name in ("mask", "depth", "rgb") if name in self._names), None)
        if name is None:
            raise MotionError("observation_model scores images: observe mask, depth or rgb, not joints alone")
        seen = _SEEN[name](frame)[0]
        if name == "depth":
            seen = np.where(seen < FAR, seen, np.inf)
        return {name: seen if name == "rgb" else seen[..., 0]}


_SEEN = {
    "rgb": lambda frame: frame.rgb,
    "mask": lambda frame: np.uint8(255) * (frame.limbs[..., None] != 0),
    "depth": lambda frame: frame.depth[..., None].copy(),
}
