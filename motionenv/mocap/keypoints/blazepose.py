"""BlazePose (Bazarevsky et al. 2020, arXiv:2006.10204): everybody's 33 keypoints in a picture, by MediaPipe's models.

A detector finds faces and hips in the whole picture, and from each person's hips and size follows a square about them,
turned upright, in which a second model sees the keypoints and where the square of the next picture will be. So the
detector runs only now and then, or when it's needed. Decoding is that of MediaPipe's graphs `pose_detection` and
`pose_landmark`; needs `ai-edge-litert` (`motionenv[detect]`).
"""

import math
import zipfile
from pathlib import Path

import numpy as np

from motionenv.errors import MotionError
from motionenv.mocap.sources import Source, SourceFile, download

_AT = "https://storage.googleapis.com/mediapipe-assets/"
_DETECTOR, _LANDMARKS = "pose_detection.tflite", "pose_landmark_full.tflite"
#: The models, as published by their makers, and as in MediaPipe 0.10.14.
MODELS = Source(
    "blazepose", "BlazePose: detector and landmarks", "https://ai.google.dev/edge/mediapipe/solutions/vision/"
    "pose_landmarker", "Apache 2.0", "V. Bazarevsky et al., BlazePose (2020)", (
        SourceFile(_DETECTOR, f"{_AT}{_DETECTOR}?generation=1678737489600422",
                   "9ba9dd3d42efaaba86b4ff0122b06f29c4122e756b329d89dca1e297fd8f866c", 2959046),
        SourceFile(_LANDMARKS, f"{_AT}{_LANDMARKS}?generation=1661875894245786",
                   "e9a5c5cb17f736fafd4c2ec1da3b3d331d6edbe8a0d32395855aeb2cdfd64b9f", 6440512),
    ),
)  # fmt: skip
_NAMES = (_DETECTOR, "pose_detector.tflite"), (_LANDMARKS, "pose_landmarks_detector.tflite")  # the latter in .task

_STRIDES = {8: 2, 16: 2, 32: 6}  # anchors of each cell of so many pixels
_FACE, _SURE = 0.5, 0.75  # least scores of a detection in the whole picture and in a part of it, which may cut bodies
_PRESENT, _REFINED = 0.5, 0.5  # least scores of a person, and of a peak in a heat map
_OVERLAP = 0.3  # of detections of one face
_AROUND = 1.25  # side of a square, relative to twice the distance from hips to its edge
_SAME = 0.3  # least distance of two people's hips, relative to the smaller one's circle
_COVERED = 0.5  # most of the box around a trunk and head that is somebody else's
_PART, _INSIDE = 0.65, 0.8  # size of what can be a part of a body, relative to it, and how much of its box is inside
_TRUNK = [*range(13), 23, 24]  # head, shoulders and hips
_KEYPOINTS, _ALIGNED = 33, slice(33, 35)  # the next square's centre and edge follow the keypoints


class BlazePose:
    """Sees people in pictures of a film, one after the other; `models` are the content of the two files."""

    def __init__(self, models: tuple[bytes, bytes]) -> None:
        self._detect, self._look = (_Model(content) for content in models)
        self._anchors = _anchors(self._detect.side)
        self._squares: list[np.ndarray] = []
        self._turn = 0

    def __call__(self, picture: np.ndarray) -> list[np.ndarray]:
        """Keypoints (33, 3), x, y [pixels] and visibility, of everybody in a `picture`, uint8 (height, width, 3)."""
        regions = _regions(*picture.shape[1::-1])
        found = self._seen(picture, self._squares)
        some = [regions[self._turn % len(regions)]] if found and len(found) == len(self._squares) else regions
        self._turn += 1
        for region in some:
            known = [points[_ALIGNED, :2] for points in found]
            new = [face for face in self._faces(picture, *region) if not any(_near(face, one) for one in known)]
            found = _distinct(found + self._seen(picture, new))
        self._squares = [points[_ALIGNED, :2] for points in found]
        return [points[:_KEYPOINTS] - [0.5, 0.5, 0.0] for points in found]  # a pixel's middle is whole

    def _faces(self, picture: np.ndarray, corner: np.ndarray, side: float) -> list[np.ndarray]:
        """Centre of the hips and a point on the edge of the body's circle (2, 2) of everybody seen in a region."""
        boxes, scores = self._detect(2 * _sampled(picture, corner, np.eye(2) * side, self._detect.side) - 1)
        boxes = boxes.reshape(-1, 6, 2) / self._detect.side
        boxes[:, [0, 2, 3]] += self._anchors[:, None]
        scores = 1 / (1 + np.exp(-np.clip(scores.ravel(), -100, 100)))
        sure = scores > (_FACE if side >= max(picture.shape[:2]) else _SURE)
        return [corner + side * box[2:4] for box in _suppressed(boxes[sure], scores[sure])]

    def _seen(self, picture: np.ndarray, squares: list[np.ndarray]) -> list[np.ndarray]:
        """Points (39, 3) of everybody in `squares`, each of a centre and a point on the edge (2, 2)."""
        found = []
        for centre, edge in squares:
            up = _AROUND * (edge - centre)
            axes = 2 * np.array([[-up[1], up[0]], -up])  # from the left to the right, from the top to the bottom
            corner = centre - axes.sum(axis=0) / 2
            values, score, heat = self._look(_sampled(picture, corner, axes, self._look.side))
            values = values.reshape(-1, 5)
            if score > _PRESENT:
                at = _refined(values[:, :2] / self._look.side, heat) @ axes + corner
                found.append(np.column_stack([at, 1 / (1 + np.exp(-values[:, 3:].min(axis=1)))]))
        return _distinct(found)


class _Model:
    """A model of one square picture; outputs come without the batch, keypoints before scores before heat maps."""

    def __init__(self, content: bytes) -> None:
        from ai_edge_litert.interpreter import Interpreter

        self._interpreter = Interpreter(model_content=content)
        self._interpreter.allocate_tensors()
        (given,) = self._interpreter.get_input_details()
        self._given, self.side = given["index"], int(given["shape"][1])
        shapes = {tuple(one["shape"][1:]): one["index"] for one in self._interpreter.get_output_details()}
        kinds = ((2254, 12), (2254, 1)) if (2254, 12) in shapes else ((195,), (1,), (64, 64, 39))
        self._outputs = [shapes[kind] for kind in kinds]

    def __call__(self, picture: np.ndarray) -> list[np.ndarray]:
        self._interpreter.set_tensor(self._given, picture[None].astype(np.float32))
        self._interpreter.invoke()
        return [self._interpreter.get_tensor(index)[0].astype(float) for index in self._outputs]


def read_models(weights: str | Path | None, folder: Path, base_url: str | None = None) -> tuple[bytes, bytes]:
    """Contents of both models' files.

    Args:
        weights: a folder that has them, or an archive (MediaPipe's `.task` or wheel); None downloads them once.
        folder: where downloads are kept.
        base_url: of a mirror of `MODELS`.

    Raises:
        MotionError: they can't be had.
    """
    if weights is None:
        one, other = (path.read_bytes() for path in download(MODELS, folder, base_url=base_url))
        return one, other
    path = Path(weights)
    try:
        if path.is_dir():
            held = {p.name: p.read_bytes() for p in path.rglob("*.tflite")}
        else:
            with zipfile.ZipFile(path) as archive:
                held = {n.rpartition("/")[2]: archive.read(n) for n in archive.namelist() if n.endswith(".tflite")}
    except (OSError, zipfile.BadZipFile) as error:
        raise MotionError(f"can't read the weights {path}: {error}") from error
    found = [next((held[name] for name in names if name in held), None) for names in _NAMES]
    if found[0] is None or found[1] is None:
        wanted = " and ".join(" or ".join(names) for names in _NAMES)
        raise MotionError(f"weights {path} must be a folder, .task or .whl that has {wanted}; it has {sorted(held)}")
    return found[0], found[1]


def _anchors(side: int) -> np.ndarray:
    """Centres (n, 2) of the cells of the detector's grids, relative to its picture."""
    grids = []
    for stride, times in _STRIDES.items():
        rows, columns = (np.mgrid[: side // stride, : side // stride] + 0.5) * stride / side
        grids.append(np.stack([columns, rows], axis=-1).reshape(-1, 2).repeat(times, axis=0))
    return np.concatenate(grids)


def _suppressed(boxes: np.ndarray, scores: np.ndarray) -> list[np.ndarray]:
    """Means, weighted by `scores` (n,), of `boxes` (n, 6, 2), centre, size and points, of one face each."""
    out, left = [], np.argsort(-scores)
    low, high = boxes[:, 0] - boxes[:, 1] / 2, boxes[:, 0] + boxes[:, 1] / 2
    while len(left):
        best = left[0]
        sides = np.minimum(high[left], high[best]) - np.maximum(low[left], low[best])
        common = np.prod(np.maximum(sides, 0), axis=-1)
        areas = np.prod(boxes[:, 1], axis=-1)
        same = common > _OVERLAP * (areas[left] + areas[best] - common)
        same[0] = True
        out.append(np.average(boxes[left[same]], axis=0, weights=scores[left[same]]))
        left = left[~same]
    return out


def _refined(at: np.ndarray, heat: np.ndarray) -> np.ndarray:
    """Points (n, 2), relative to the square, moved to the middle of the peak near each in its heat map (h, w, n)."""
    out, size = at.copy(), np.array(heat.shape[1::-1])
    for i, (column, row) in enumerate(np.floor(at * size).astype(int).tolist()):
        if not (0 <= column < size[0] and 0 <= row < size[1]):
            continue
        c0, r0 = max(0, column - 3), max(0, row - 3)
        sure = 1 / (1 + np.exp(-heat[r0 : row + 4, c0 : column + 4, i]))
        if sure.max() >= _REFINED:
            rows, columns = np.indices(sure.shape)
            out[i] = np.array([(columns * sure).sum() / sure.sum() + c0, (rows * sure).sum() / sure.sum() + r0]) / size
    return out


def _distinct(found: list[np.ndarray]) -> list[np.ndarray]:
    """Points (39, 3) of everybody once: as they are seen most surely and largest."""
    kept: list[np.ndarray] = []
    for one in sorted(found, key=lambda points: -_radius(points[_ALIGNED, :2]) * points[:_KEYPOINTS, 2].mean()):
        if not any(_one_body(one, other) for other in kept):
            kept.append(one)
    return kept


def _one_body(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether points (39, 3) have the same trunk, or the smaller are a part of the larger that looks like a person."""
    small, large = sorted(_radius(points[_ALIGNED, :2]) for points in (one, other))
    part = small < _PART * large and _common(one[:_KEYPOINTS], other[:_KEYPOINTS]) > _INSIDE
    return part or _common(one[_TRUNK], other[_TRUNK]) > _COVERED


def _common(one: np.ndarray, other: np.ndarray) -> float:
    """Area common to the boxes around points (n, 3), relative to the smaller box."""
    (low, high), (down, up) = ((p[:, :2].min(axis=0), p[:, :2].max(axis=0)) for p in (one, other))
    common = np.prod(np.maximum(np.minimum(high, up) - np.maximum(low, down), 0))
    return float(common / max(min(np.prod(high - low), np.prod(up - down)), 1e-9))


def _near(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether two squares, of a centre and a point on the edge (2, 2), are of one person."""
    return bool(np.linalg.norm(one[0] - other[0]) < _SAME * min(_radius(one), _radius(other)))


def _radius(square: np.ndarray) -> float:
    return float(np.linalg.norm(square[1] - square[0]))


def _regions(width: int, height: int) -> list[tuple[np.ndarray, float]]:
    """Corners and sides of squares to look at: the whole picture, and parts half as long that overlap by half."""
    side = max(width, height)
    starts = [np.linspace(0, n - side / 2, max(1, math.ceil(4 * n / side) - 1)) for n in (width, height)]
    parts = [(np.array([x, y]), side / 2) for y in starts[1] for x in starts[0]]
    return [((np.array([width, height]) - side) / 2, float(side)), *parts]


def _sampled(picture: np.ndarray, corner: np.ndarray, axes: np.ndarray, side: int) -> np.ndarray:
    """A parallelogram of a picture, (side, side, 3) from 0 to 1; black outside of the picture.

    Where pixels of the picture are smaller than its own, means of squares of them are interpolated.

    Args:
        picture: uint8 (height, width, 3).
        corner: (2,) its first corner, column and row of the pixels' outer edges.
        axes: (2, 2) its edges along a row and along a column.
        side: pixels of each side.
    """
    steps = axes / side
    times = max(1, int(np.linalg.norm(steps, axis=1).min()))
    around = np.array([corner + i * axes[0] + j * axes[1] for i in (0, 1) for j in (0, 1)])
    most = np.array(picture.shape[1::-1]) // times
    low = np.clip(np.floor(around.min(axis=0) / times).astype(int) - 1, 0, most - 1)
    high = np.clip(np.ceil(around.max(axis=0) / times).astype(int) + 1, low + 1, most)
    part = picture[low[1] * times : high[1] * times, low[0] * times : high[0] * times]
    part = _reduced(part, times)
    grid = np.arange(side) + 0.5
    at = (corner + grid[:, None, None] * steps[1] + grid[:, None] * steps[0]) / times - low + 0.5  # padded by 1
    padded = np.pad(part, ((1, 1), (1, 1), (0, 0)))
    cells = np.floor(np.clip(at, 0, np.array(padded.shape[1::-1]) - 1.001)).astype(np.intp)
    across, down = np.moveaxis(np.clip(at - cells, 0, 1).astype(np.float32), -1, 0)[..., None]
    flat, wide = padded.reshape(-1, 3), padded.shape[1]
    first = cells[..., 1] * wide + cells[..., 0]
    upper = flat[first] * (1 - across) + flat[first + 1] * across
    lower = flat[first + wide] * (1 - across) + flat[first + wide + 1] * across
    inside = ((at >= 0) & (at <= np.array(padded.shape[1::-1]) - 1)).all(axis=-1, keepdims=True)
    return (upper * (1 - down) + lower * down) * inside / 255


def _reduced(picture: np.ndarray, times: int) -> np.ndarray:
    """Means (rows, columns, 3) of squares of `times` pixels; those cut by the picture's end are left out."""
    rows, columns = (n // times * times for n in picture.shape[:2])
    whole = picture[:rows, :columns]
    sums = np.zeros((rows // times, columns, 3), dtype=np.uint16)
    for i in range(times):
        sums += whole[i::times]
    out = np.zeros((rows // times, columns // times, 3), dtype=np.float32)
    for j in range(times):
        out += sums[:, j::times]
    return out / times**2
