"""Short representations: one line of text for the prompt, small pictures for notebooks."""

import base64
import io
from collections.abc import Iterable, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

_MOST = 118  # characters of a line
_STRIP = 8  # frames


class OneLine:
    """Base of dataclasses that hold arrays, with `repr=False`: one line that names the fields and arrays' shapes."""

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._shown()})"

    def _shown(self) -> str:
        """The text in the brackets."""
        shown = {f.name: getattr(self, f.name) for f in fields(self) if f.repr}  # type: ignore[arg-type]
        return listed(shown, _MOST - len(type(self).__name__))


def listed(values: dict[str, Any], most: int = _MOST) -> str:
    """Names and short values, up to `most` characters; those that are None or empty are left out."""
    empty = lambda value: value is None or (isinstance(value, str | tuple | list | dict) and not len(value))
    texts = [f"{name}={short(value)}" for name, value in values.items() if not empty(value)]
    while len(line := ", ".join(texts)) > most:
        texts = [*(texts[:-2] if texts[-1] == "..." else texts[:-1]), "..."]
    return line


def short(value: Any) -> str:
    """An array by its shape, a number with four digits, anything longer than a few words by its type or size."""
    if isinstance(value, np.ndarray):
        return f"array{value.shape}".replace(",)", ")")
    if isinstance(value, float):
        return f"{value:.4g}"
    if is_dataclass(value) and not isinstance(value, type):
        return f"{type(value).__name__}(...)"
    text = repr(value)
    if len(text) <= 30:
        return text
    if isinstance(value, tuple | list | dict):
        return f"<{len(value)} values>"
    return f"{text[:27]}..." if isinstance(value, str) else f"<{type(value).__name__}>"


def counted(count: int, one: str, many: str = "") -> str:
    """A number and what it counts: "1 frame", "2 frames"."""
    return f"{count} {one if count == 1 else many or f'{one}s'}"


def some(count: int) -> np.ndarray:
    """Up to eight of `count` indices, evenly spaced."""
    return np.linspace(0, count - 1, min(count, _STRIP)).round().astype(int)


def svg(width: float, height: float, lines: Iterable[np.ndarray], caption: str) -> str:
    """Polylines (n, 2) [pixels, y down], in parts where they have NaN, with a caption below."""
    drawn = []
    for line in lines:
        known = np.isfinite(line).all(1)
        for run in np.split(line, np.flatnonzero(np.diff(known)) + 1):
            if len(run) > 1 and np.isfinite(run).all():
                points = " ".join(f"{x:.1f},{y:.1f}" for x, y in run)
                drawn.append(f'<polyline points="{points}" fill="none" stroke="currentColor"/>')
    size = f'width="{width:.0f}" height="{height:.0f}"'
    return f'<figure><svg {size} role="img">{"".join(drawn)}</svg><figcaption>{caption}</figcaption></figure>'


def figures(points: np.ndarray, edges: Sequence[tuple[int, int]], caption: str) -> str:
    """Stick figures of points (frames, points, 3) [m], z up, seen from the right side, one beside the other."""
    side, wide, tall = points[:, :, [0, 2]], 100, 150
    scale = 0.95 * tall / np.nanmax(side[..., 1], initial=1.0)
    middle = np.nan_to_num(side[:, :, 0].sum(1, where=np.isfinite(side[..., 0])) / points.shape[1])
    x = (side[..., 0] - middle[:, None]) * scale + wide * (np.arange(len(side))[:, None] + 0.5)
    pixels = np.stack([x, tall - side[..., 1] * scale], -1)
    return svg(wide * len(side), tall, (frame[list(edge)] for frame in pixels for edge in edges), caption)


def curves(values: np.ndarray, caption: str) -> str:
    """Curves (curves, samples) over one another."""
    low, high = np.nanmin(values, initial=0.0), np.nanmax(values, initial=0.0)
    x = np.linspace(0, 300, values.shape[1])
    y = 120 - 120 * (values - low) / max(high - low, 1e-9)
    return svg(300, 120, (np.stack([x, row], 1) for row in y), caption)


def picture(rgb: np.ndarray, caption: str) -> str:
    """A picture (height, width, 3) uint8."""
    from PIL import Image

    png = io.BytesIO()
    Image.fromarray(rgb).save(png, "png")
    source = f"data:image/png;base64,{base64.b64encode(png.getvalue()).decode()}"
    return f'<figure><img src="{source}" alt="{caption}"/><figcaption>{caption}</figcaption></figure>'
