"""Make the stimuli of a set: films or frames, where each dot is, and a file from which anyone can make them again."""

import hashlib
import io
import json
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from motionenv.body import EDGES
from motionenv.data.stimuli.dots import Dots, Ring, dots_at
from motionenv.data.stimuli.specification import Display, PointLightWalker, StimulusSet
from motionenv.errors import MotionError
from motionenv.models import cycle
from motionenv.models.base import GaitModel
from motionenv.models.registry import gait_model
from motionenv.render.draw2d.shapes import draw_figures
from motionenv.render.video.encode import png, stream_video
from motionenv.types import MARKERS

_GRID = 64  # positions are rounded to this part of a pixel: a processor's rounding errors hardly ever reach a picture
_MOST = 100  # frames that are drawn together
_EPOCH = (1980, 1, 1, 0, 0, 0)  # of files in an archive, so that its bytes depend on nothing else


def ring(person: PointLightWalker, models: Callable[[str], GaitModel] = gait_model) -> Ring:
    """One cycle of a person's walk; `models` gives the fitted model of a name, by default those that ship, and files.

    Raises:
        MotionError: there is no such model, it makes no cycles in place, or it has fewer components.
    """
    walk = cycle(models(person.model), deviations=person.deviations or None, speed=person.speed, height=person.height)
    return Ring(walk.markers, walk.stride, walk.seconds, walk.body.height)


def pixels_of(asked: StimulusSet, dots: Dots) -> np.ndarray:
    """(T, n, 2) where dots are in the pictures [pixels], x to the right and y down, rounded; NaN where invisible."""
    scale = asked.size * asked.height
    middle = np.array([asked.width - 1, asked.height - 1]) / 2
    found = middle + scale * dots.plane * [1, -1]
    return np.where(dots.visible[..., None], np.round(found * _GRID) / _GRID, np.nan)


def frames_of(asked: StimulusSet, person: PointLightWalker, display: Display) -> Iterator[np.ndarray]:
    """The pictures (height, width, 3) uint8 of a stimulus, one after the other.

    Args:
        asked: says how large they are and how many.
        person, display: of the stimulus.

    Raises:
        MotionError: the model is unknown or has no cycles in place, or has fewer components.
    """
    dots = dots_at(display, ring(person), np.arange(asked.frames) / asked.fps)
    yield from _drawn(asked, display, pixels_of(asked, dots), dots.depth)


def _drawn(asked: StimulusSet, display: Display, pixels: np.ndarray, depth: np.ndarray) -> Iterator[np.ndarray]:
    grey = np.full((pixels.shape[1], 3), np.round(255 * display.grey))
    scale = asked.size * asked.height / 100
    edges = EDGES if display.lines else ()
    for start in range(0, len(pixels), _MOST):
        part = slice(start, start + _MOST)
        images = np.full((len(pixels[part]), asked.height, asked.width, 3), round(255 * display.background), np.uint8)
        draw_figures(
            images, pixels[part], depth[part], edges, grey,
            radius=0.5 * display.dot_size * scale, width=display.line_width * scale,
        )  # fmt: skip
        yield from images


def files_of(
    asked: StimulusSet, step: Callable[[int], None] | None = None, models: Callable[[str], GaitModel] = gait_model
) -> Iterator[tuple[str, bytes]]:
    """Names and contents of all files of a set, `stimuli.json` last; `step` gets the number of frames done."""
    made: list[dict[str, Any]] = []
    walks = [ring(person, models) for person in asked.people]
    for i, walk in enumerate(walks):
        for j, display in enumerate(asked.displays):
            name = f"person-{i + 1:03d}-display-{j + 1:03d}"
            dots = dots_at(display, walk, np.arange(asked.frames) / asked.fps)
            pixels = pixels_of(asked, dots)
            digest = hashlib.sha256()
            before = asked.frames * len(made)
            frames = _told(_drawn(asked, display, pixels, dots.depth), digest.update, before, step)
            yield from _encoded(asked, name, frames)
            yield f"{name}.csv", _table(pixels, asked.fps)
            told = {"stride": walk.stride, "cycle_seconds": walk.seconds, "body_height": walk.height}
            made.append({"name": name, "person": i, "display": j, "sha256_of_pixels": digest.hexdigest(), **told})
    content = {"set": asked.model_dump(mode="json"), "markers": MARKERS, "stimuli": made}
    yield "stimuli.json", (json.dumps(content, indent=2) + "\n").encode()


def _told(frames, update, before: int, step) -> Iterator[np.ndarray]:
    for number, frame in enumerate(frames, before + 1):
        update(frame.tobytes())
        if step is not None:
            step(number)
        yield frame


def _encoded(asked: StimulusSet, name: str, frames: Iterator[np.ndarray]) -> Iterator[tuple[str, bytes]]:
    if asked.format == "mp4":
        yield f"{name}.mp4", b"".join(stream_video(frames, asked.fps, crf=10))
        return
    for number, frame in enumerate(frames):
        yield f"{name}/{number:06d}.png", png(frame)


def _table(pixels: np.ndarray, fps: float) -> bytes:
    """Rows of time [s], dot, x and y [pixels] of the dots that are visible."""
    lines = ["seconds,dot,x,y"]
    for number, frame in enumerate(pixels):
        seconds = f"{number / fps:.6f}"
        for dot, (x, y) in enumerate(frame):
            if np.isfinite(x):
                lines.append(f"{seconds},{MARKERS[dot] if dot < len(MARKERS) else f'mask {dot - 14}'},{x:g},{y:g}")
    return "\n".join([*lines, ""]).encode()


def write_stimuli(asked: StimulusSet, out: Path, *, step: Callable[[int], None] | None = None) -> Path:
    """Write a set as a new folder, whole or not at all; returns the path of its `stimuli.json`.

    Beside films or folders of frames there is a table (.csv) of where the dots of each stimulus are. `stimuli.json` has
    the SHA-256 of the pixels, by which to compare two sets; encoded files depend on the encoder's version.

    Args:
        asked: the set.
        out: the folder, new or empty, in one that exists.
        step: called with the number of frames done.

    Raises:
        MotionError: the folder has files in it or can't be written, or as of `frames_of`.
    """
    folder = Path(out)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise MotionError(f"{folder} must be a new or an empty folder: choose another")
    try:
        with tempfile.TemporaryDirectory(prefix=f".{folder.name}-", dir=folder.parent) as beside:
            part = Path(beside) / "set"
            for name, content in files_of(asked, step):
                (part / name).parent.mkdir(parents=True, exist_ok=True)
                (part / name).write_bytes(content)
            part.replace(folder)
    except OSError as error:
        raise MotionError(f"can't write {folder}: {error.strerror or error}; nothing was left half-written") from error
    return folder / "stimuli.json"


def zipped(asked: StimulusSet, models: Callable[[str], GaitModel] = gait_model) -> Iterator[bytes]:
    """A ZIP archive of what `write_stimuli` writes of the set `asked`, piece by piece; the same bytes each time.

    `models` is as of `ring`.

    Raises:
        MotionError: as of `frames_of`.
    """
    sink = _Sink()
    with zipfile.ZipFile(sink, "w") as archive:
        for name, content in files_of(asked, models=models):
            entry = zipfile.ZipInfo(name, _EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED if name.endswith((".csv", ".json")) else zipfile.ZIP_STORED
            archive.writestr(entry, content)
            yield sink.taken()
    yield sink.taken()


class _Sink(io.RawIOBase):
    """Collects what is written, which can't be gone back to."""

    def __init__(self):
        self.parts: list[bytes] = []

    def writable(self) -> bool:
        return True

    def write(self, data) -> int:
        self.parts.append(bytes(data))
        return len(data)

    def taken(self) -> bytes:
        taken, self.parts = b"".join(self.parts), []
        return taken
