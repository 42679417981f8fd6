"""What a motion is sent as: picked by the request's Accept header (RFC 9110, section 12.5.1)."""

from collections.abc import Iterable

import mimeparse

from service.problems import Problem

JSON = "application/json"
NPY = "application/x-npy"
NPZ = "application/x-npz"
CSV = "text/csv"
BVH = "model/x-bvh"
MP4, GIF, PNG = "video/mp4", "image/gif", "image/png"
#: Suffixes of the formats that `motionenv.write` writes.
FILES = {
    NPZ: ".npz",
    CSV: ".csv",
    BVH: ".bvh",
    "model/gltf-binary": ".glb",
    "application/x-c3d": ".c3d",
}
#: Suffixes of the formats that show it.
FILMS = {MP4: ".mp4", GIF: ".gif", "image/webp": ".webp", PNG: ".png"}
MOTION = (JSON, NPY, *FILES, *FILMS)


def negotiated(accept: str | None, offered: Iterable[str]) -> str:
    """The media type to answer with: the first offered one where the client takes anything.

    Args:
        accept: the header, or None.
        offered: media types, the preferred one first.

    Raises:
        Problem: 406, the client takes none of them.
    """
    offered = list(offered)
    if not accept or accept == "*/*":
        return offered[0]
    if accept in offered:
        return accept
    try:
        best = mimeparse.best_match(offered[::-1], accept)
    except (mimeparse.MimeTypeParseException, ValueError):
        best = ""
    if not best:
        raise Problem(406, f"none of what is accepted can be made: it can be {', '.join(offered)}")
    return best
