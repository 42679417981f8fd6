"""Pictures of samples: the walker and the passers-by, each in front of what is farther away, and the scenery."""

import numpy as np

from motionenv.body.limbs import COLOURS
from motionenv.data.samples.groups import Group
from motionenv.data.samples.walkers import CLOTHES, LIGHT, PELVIS, SCENERY, WALKERS, generator
from motionenv.data.specification import Specification
from motionenv.render.raycast.multi_body import WORN, MultiBodyRaycaster, outfits
from motionenv.render.scene import Scene
from motionenv.render.sensors.augmentation import FAR, Augmentation, Augmenter
from motionenv.types import Frame

_BEHIND = 2.0  # distance of the background relative to the walker's


class Drawing:
    """Draws the pictures of a specification's samples; `rgb` says whether colours are wanted."""

    def __init__(self, spec: Specification, *, rgb: bool) -> None:
        self.spec, self.rgb, look = spec, rgb, spec.pictures
        self._raycaster: tuple[int, MultiBodyRaycaster] | None = None
        self._scenery = None
        if look.background != "black":
            numbers = look.objects, look.occluders, look.noise, look.flicker
            self._scenery = Augmentation(look.background, *numbers, people=False)
        self._dressed: tuple[int, np.ndarray] | None = None

    def draw(self, group: Group, which: np.ndarray) -> dict[str, np.ndarray]:
        """Pictures by their names, (k, frames, height, width), of samples `which` (k,) of a group.

        They are the same whichever samples are drawn together.
        """
        frames = group.poses.shape[1]
        colours = self._colours(group)
        walker = (group.offsets, group.radii, group.heights, colours[0])
        frame = self._bodies(group, which, group.poses, walker)
        people = (frame.limbs > 0).astype(np.uint8)
        passers = group.passers
        for k, present in enumerate(passers.present):
            some = np.flatnonzero(present[which])
            if len(some):
                body = (passers.offsets[k], passers.radii[k], passers.heights[k], colours[1 + k])
                there = (some[:, None] * frames + np.arange(frames)).reshape(-1)
                _put(self._bodies(group, which[some], passers.poses[k], body), k + 2, there, frame, people)
        self._surround(group, which, frame)
        people[frame.limbs == 0] = 0
        whole = (len(which), frames, self.spec.pictures.height, self.spec.pictures.width)
        found = {
            "limbs": frame.limbs, "people": people, "depth": frame.depth, "mask": 255 * (people == 1).view(np.uint8),
        }  # fmt: skip
        found = {name: picture.reshape(whole) for name, picture in found.items()}
        return found if frame.rgb is None else found | {"rgb": frame.rgb.reshape(*whole, 3)}

    def _bodies(self, group: Group, which: np.ndarray, poses: np.ndarray, body: tuple) -> Frame:
        """Pictures of a body on black, with one axis for samples `which` and their frames."""
        frames, views = poses.shape[1], group.views
        *each, K, R = (np.repeat(part[which], frames, axis=0) for part in (*body, views.K, views.R))
        t = views.t[which].reshape(-1, 3)
        offsets, radii, heights, colours = each
        shown = poses[which].reshape(-1, 25)
        return self._lit(group.number).render(shown, offsets, radii, heights, colours, K, R, t, rgb=self.rgb)

    def _lit(self, number: int) -> MultiBodyRaycaster:
        if self._raycaster is None or (self._raycaster[0] != number and self.spec.pictures.light == "varied"):
            look = self.spec.pictures
            self._raycaster = number, MultiBodyRaycaster(look.width, look.height, scene=self._light(number))
        return self._raycaster[1]

    def _surround(self, group: Group, which: np.ndarray, frame: Frame) -> None:
        if self._scenery is None:
            np.minimum(frame.depth, np.float32(FAR), out=frame.depth)
            return
        spec, views, n, frames = self.spec, group.views, len(which), group.poses.shape[1]
        scenery = Augmenter(self._scenery, n, spec.pictures.width, spec.pictures.height, fps=spec.fps)
        middle = group.joints[which, frames // 2, PELVIS]
        away = np.maximum(np.einsum("nj,nj->n", views.R[which, 2], middle) + views.t[which, frames // 2, 2], 0.5)
        focal = views.K[which, 0, 0]
        for slot, j in enumerate(which.tolist()):
            rng = generator(spec.seed, group.number * WALKERS * spec.people.views + j, SCENERY)
            scenery.begin(slot, rng, distance=away[slot], behind=_BEHIND * away[slot], focal=focal[slot])
        pan = views.pan[which] * (focal / (_BEHIND * away))[:, None]
        scenery.compose(frame, np.tile(np.arange(frames), n), pan.reshape(-1), np.repeat(np.arange(n), frames))

    def _light(self, number: int) -> Scene:
        if self.spec.pictures.light == "fixed":
            return Scene()
        rng = generator(self.spec.seed, number, LIGHT)
        angle, height = rng.uniform(-np.pi, np.pi, 2), rng.uniform(0.3, 1.5, 2)
        key, fill = ((float(np.cos(a)), float(np.sin(a)), float(h)) for a, h in zip(angle, height, strict=True))
        strength, warmth = rng.uniform(0.6, 1.2), rng.uniform(-0.2, 0.2)
        tint = np.array([1 + warmth, 1.0, 1 - warmth])
        default = Scene()
        return Scene(
            key=key, fill=fill, key_light=tuple(strength * tint * default.key_light),
            fill_light=tuple(rng.uniform(0.5, 1.5) * np.array(default.fill_light)),
        )  # fmt: skip

    def _colours(self, group: Group) -> np.ndarray:
        """Colours (1 + most passers-by, n, 5, 3) of skin and clothes of everybody in a group's samples."""
        if self._dressed is None or self._dressed[0] != group.number:
            people, n = 1 + len(group.passers.present), len(group.poses)
            if self.spec.people.clothes:
                drawn = outfits(generator(self.spec.seed, group.number, CLOTHES).random((people, n, len(WORN), 3)))
                drawn[0] = drawn[0, np.arange(n) % WALKERS]  # who walks wears the same in all views
            else:
                drawn = np.broadcast_to(np.array([*COLOURS.values()]), (people, n, len(WORN), 3))
            self._dressed = group.number, drawn
        return self._dressed[1]


def _put(other: Frame, number: int, there: np.ndarray, frame: Frame, people: np.ndarray) -> None:
    """Put the pictures `other` of the person `number` into those `there` (m,) of `frame`, wherever it is nearer."""
    near = other.depth < frame.depth[there]
    frame.depth[there] = np.where(near, other.depth, frame.depth[there])
    frame.limbs[there] = np.where(near, other.limbs, frame.limbs[there])
    people[there] = np.where(near, np.uint8(number), people[there])
    if frame.rgb is not None and other.rgb is not None:
        frame.rgb[there] = np.where(near[..., None], other.rgb, frame.rgb[there])
