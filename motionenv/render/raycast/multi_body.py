"""Render a batch of different people, each with their own clothes and camera, on black.

`Raycaster` renders one body in many poses; `MultiBodyRaycaster` renders bodies that differ in everything, for vector
environments, with the same kernels: pixel by pixel the same result as `Raycaster` with a scene without ground.
"""

import numpy as np

from motionenv._core.threads import Workers
from motionenv._core.validation import PICTURE_SIZES, checked_whole
from motionenv.body.limbs import CLOTHES, COLOURS, LIMBS
from motionenv.errors import MotionError
from motionenv.render.raycast._draw_kernel import draw_crowd
from motionenv.render.raycast._shade_kernel import encoding
from motionenv.render.request import check_frame, empty_frame
from motionenv.render.scene import Scene, linear
from motionenv.types import Frame, shape_text

#: Clothes in the order of the colours of `MultiBodyRaycaster.render`.
WORN = tuple(COLOURS)

_SHAPES: dict[str, tuple[int, ...]] = {
    "poses": (25,), "offsets": (16, 3), "radii": (len(LIMBS), 2), "heights": (), "colours": (len(WORN), 3),
    "K": (3, 3), "R": (3, 3), "t": (3,),
}  # fmt: skip
# sRGB: darkest and lightest skin and hair, grey hair; greatest brightness of shirt, trousers and shoes.
_SKIN, _HAIR = np.array([(0.27, 0.17, 0.12), (0.96, 0.80, 0.69)]), np.array([(0.06, 0.05, 0.04), (0.80, 0.65, 0.42)])
_GREY, _BRIGHT = 0.62, np.array([[1.0], [0.75], [0.6]])
_WORN_BY_LIMB = np.array([WORN.index(worn) for worn in CLOTHES])
_ENCODING = encoding()
_NOTHING = np.empty((0, 0, 0, 3), np.uint8)


class MultiBodyRaycaster:
    """Renders images, `width` × `height` [pixels], of n different bodies, on a number of `threads`.

    The `scene` provides the light; its clothes, ground and sky are ignored.
    """

    def __init__(self, width: int, height: int, *, scene: Scene | None = None, threads: int | None = 1) -> None:
        self.width = checked_whole(width, "width", *PICTURE_SIZES, "pixels")
        self.height = checked_whole(height, "height", *PICTURE_SIZES, "pixels")
        self.scene = scene or Scene()
        self._workers = Workers(threads, "crowd")
        self._lights = self.scene.lights
        self._ambient = np.array(self.scene.ambient, np.float32)

    @property
    def threads(self) -> int:
        """Number of threads."""
        return self._workers.threads

    def render(
        self, poses: np.ndarray, offsets: np.ndarray, radii: np.ndarray, heights: np.ndarray, colours: np.ndarray,
        K: np.ndarray, R: np.ndarray, t: np.ndarray, *, rgb: bool = True, out: Frame | None = None,
    ) -> Frame:  # fmt: skip
        """Render n bodies, one in each image (n, height, width); background is black, infinitely deep, and limb 0.

        Args:
            poses: (n, 25) [m, rad], finite.
            offsets, radii, heights: those of each body's `Skeleton`, (n, 16, 3), (n, limbs, 2) and (n,) [m].
            colours: (n, 5, 3) of `WORN`: skin, shirt, trousers, shoes, hair; sRGB from 0 to 1.
            K: (n, 3, 3) intrinsics [pixels], invertible, last row (0, 0, 1).
            R, t: (n, 3, 3) and (n, 3) [m], rotations and translations world → camera.
            rgb: whether to render colours, which takes half of the time; otherwise they are None.
            out: a frame of an earlier call with the same n, to be overwritten.

        Raises:
            MotionError: an array has another shape or isn't finite, a K isn't invertible, or `out` has a wrong shape.
        """
        n = np.shape(poses)[0] if np.ndim(poses) else 0
        arrays = [
            _checked(values, name, (n, *tail))
            for (name, tail), values in zip(
                _SHAPES.items(), (poses, offsets, radii, heights, colours, K, R, t), strict=True
            )
        ]
        if not np.isfinite(np.concatenate([array.reshape(-1) for array in arrays])).all():
            raise MotionError(_complaint(arrays))
        shape = (n, self.height, self.width)
        frame = empty_frame(shape, rgb) if out is None else out
        if (frame.rgb is not None) != rgb:
            raise MotionError(f"out.rgb must be {'an array' if rgb else 'None'} if rgb={rgb}")
        check_frame(frame, shape)
        *body, colours, K, R, t = arrays
        directed = np.empty((n, 2, 6), np.float32)
        directed[:, :, :3] = self._lights[:, :3] @ R.transpose(0, 2, 1)
        directed[:, :, 3:] = self._lights[:, 3:]
        bodies, looks = tuple(body), (linear(colours).astype(np.float32), _WORN_BY_LIMB)
        cameras, lights = (K, _inverse(K), R, t), (directed, self._ambient, _ENCODING)
        pictures = frame.depth, frame.limbs, _NOTHING if frame.rgb is None else frame.rgb
        self._workers.share(lambda start, stop: draw_crowd(start, stop, bodies, looks, cameras, lights, pictures), n)
        return frame

    def close(self) -> None:
        """Stop the threads; they restart when needed."""
        self._workers.close()


def outfits(drawn: np.ndarray) -> np.ndarray:
    """Colours (..., 5, 3) of `WORN`, sRGB from 0 to 1, from as many numbers `drawn` evenly from 0 to 1."""
    colours = drawn.copy()
    colours[..., 0, :] = _SKIN[0] + drawn[..., 0, :1] * (_SKIN[1] - _SKIN[0])
    colours[..., 1:4, :] *= _BRIGHT
    natural = _HAIR[0] + drawn[..., 4, :1] ** 2 * (_HAIR[1] - _HAIR[0])
    greying = np.maximum(5 * drawn[..., 4, 1:2] - 4, 0)  # of one in five
    colours[..., 4, :] = natural + greying * (_GREY - natural)
    return colours


def _checked(values, name: str, shape: tuple) -> np.ndarray:
    """`values` as contiguous float64, of `shape`."""
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.shape != shape:
        raise MotionError(f"{name} must have shape {shape_text(shape)}, got {array.shape}")
    return array if array.flags.writeable else array.copy()  # kernels are compiled for writable arrays


def _inverse(K: np.ndarray) -> np.ndarray:
    try:
        return np.linalg.inv(K)
    except np.linalg.LinAlgError:
        raise MotionError("K must hold invertible matrices with last row (0, 0, 1)") from None


def _complaint(arrays: list[np.ndarray]) -> str:
    """Error text for the first of the arrays named in `_SHAPES` that isn't finite."""
    name, array = next((n, a) for n, a in zip(_SHAPES, arrays, strict=True) if not np.isfinite(a).all())
    at = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
    return f"{name} must be finite; {name}{list(at)} is {array[at]}: fill gaps first"
