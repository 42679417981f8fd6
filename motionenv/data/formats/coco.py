"""COCO keypoints: pictures, and one JSON file of who is in them, as pycocotools and most detectors' trainers read it.

`images/shard-000012/000000049152.png` are the pictures (in clips `..._003.png`, the frame). Everybody of whom a pixel
is seen has an annotation, with COCO's 17 keypoints; `markers` are all of our 15 in the same form. Beside COCO's fields,
pictures have `clip` and `frame`, and the camera's `K`, `R`, `t`; people have their `joints` (15, 3) [m] and the number
of the `walker`, as far as the specification asks for them. Numbers begin with 1: pycocotools takes an annotation with
the number 0 for one that nothing matches.
`annotations/person_keypoints.json` is put together from one part for each shard.
"""

import json
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import orjson

from motionenv.body import EDGES
from motionenv.body.face import FACE
from motionenv.data.formats.encoding import SUFFIX, encoded, while_drawing
from motionenv.data.samples import Sample
from motionenv.data.specification import Specification
from motionenv.data.store import Store
from motionenv.errors import MotionError
from motionenv.types import MARKERS

#: COCO's keypoints, in its order.
KEYPOINTS = (
    *FACE, *(f"{side}_{part}" for part in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
              for side in ("left", "right")),
)  # fmt: skip
_BODY = [MARKERS.index(name) for name in KEYPOINTS[len(FACE) :]]
_EDGES = [(16, 14), (14, 12), (17, 15), (15, 13), (12, 13), (6, 12), (7, 13), (6, 7), (6, 8), (7, 9), (8, 10), (9, 11)]
_NEEDED = ("rgb", "people", "pixels", "visibility", "face")
_PEOPLE = 16  # most in a picture, for the numbers of annotations
_WHOLE = "annotations/person_keypoints.json"


class Coco:
    """A `Format` of pictures with COCO's annotations."""

    name: ClassVar[str] = "coco"

    def check(self, spec: Specification) -> None:
        """Raise a MotionError unless `spec` has the fields that annotations need."""
        needed = (*_NEEDED, "others") if spec.people.passers_by[1] else _NEEDED
        if missing := [name for name in needed if name not in spec.output.fields]:
            raise MotionError(f"format coco needs {', '.join(missing)} among output.fields, too")

    def write(self, samples: Iterator[Sample], folder: Path, shard: int, spec: Specification) -> None:
        """Write a `shard` of `samples` of `spec` below `folder`; see `Format`. Another thread encodes."""
        place, suffix = f"images/shard-{shard:06d}", SUFFIX[spec.output.picture]
        (folder / place).mkdir(parents=True)
        part: dict[str, list] = {"images": [], "annotations": []}
        described = partial(_described, spec=spec)
        for sample, made in while_drawing(described, samples, spec.clip):
            for k, (content, people) in enumerate(made):
                number = int(sample["index"]) * spec.clip + k + 1
                end = "" if spec.clip == 1 else f"_{k:03d}"
                name = f"{place}/{int(sample['index']):012d}{end}.{suffix}"
                (folder / name).write_bytes(content)
                size = {"width": spec.pictures.width, "height": spec.pictures.height}
                whose = {"clip": int(sample["index"]), "frame": k, **_camera(sample, k)}
                part["images"].append({"id": number, "file_name": name, **size, **whose})
                part["annotations"] += [
                    {"id": number * _PEOPLE + who, "image_id": number, "category_id": 1, "iscrowd": 0, **one}
                    for who, one in people
                ]
        file = folder / "annotations" / "parts" / f"shard-{shard:06d}.json"
        file.parent.mkdir(parents=True)
        file.write_bytes(orjson.dumps(part))

    def finish(self, store: Store, rows: list[dict], spec: Specification) -> None:
        """Put the parts of all `rows` in a `store` together, one at a time; see `Format`."""
        paths = [file["path"] for row in rows for file in row["files"] if file["path"].startswith("annotations/parts/")]
        with store.scratch() as folder:
            whole = folder / "whole.json"
            with whole.open("wb") as file:
                file.write(json.dumps(_about(spec))[:-1].encode())
                for key in ("images", "annotations"):
                    file.write(f', "{key}": ['.encode())
                    for k, path in enumerate(paths):
                        file.write((b",\n" if k else b"\n") + orjson.dumps(_part(store, path)[key])[1:-1])
                    file.write(b"]")
                file.write(b"}\n")
            store.put(whole, _WHOLE)


def _part(store: Store, path: str) -> dict[str, Any]:
    content = store.read(path)
    if content is None:
        raise MotionError(f"{store.folder} lacks {path}: delete its row in the manifest, and make it again")
    return orjson.loads(content)


def _about(spec: Specification) -> dict[str, Any]:
    """Common head of all annotations."""
    return {
        "info": {"description": "Walking people, drawn by motionenv", "hash": spec.hash, "seed": spec.seed},
        "categories": [
            {
                "id": 1, "name": "person", "supercategory": "person", "keypoints": list(KEYPOINTS), "skeleton": _EDGES,
                "markers": list(MARKERS), "marker_skeleton": [[a + 1, b + 1] for a, b in EDGES],
            }
        ],
    }  # fmt: skip


def _described(sample: Sample, spec: Specification) -> list[tuple[bytes, list[tuple[int, dict[str, Any]]]]]:
    """Each frame of a sample as a file, and the numbers and annotations of the people whom it shows."""
    lead = (spec.clip,)  # single pictures lack the axis of frames
    rgb, people = (sample[name].reshape(lead + sample[name].shape[-n:]) for name, n in (("rgb", 3), ("people", 2)))
    everybody = [(sample["pixels"], sample["visibility"], sample["face"])]
    if spec.people.passers_by[1]:
        everybody += zip(*(sample[f"others_{name}"] for name in ("pixels", "visibility", "face")), strict=True)
    shapes = (15, 2), (15,), (5, 3)
    points = [[part.reshape(-1, *shape) for part, shape in zip(one, shapes, strict=True)] for one in everybody]
    made = []
    for k in range(spec.clip):
        found = [
            (who, {**_annotation(people[k] == who + 1, *(part[k] for part in one)), **_of_person(sample, who, k)})
            for who, one in enumerate(points)
            if (people[k] == who + 1).any()
        ]
        made.append((encoded(rgb[k], spec.output.picture), found))
    return made


def _camera(sample: Sample, frame: int) -> dict[str, list]:
    """`K`, `R` and `t` of the camera of a frame, if the sample has them."""
    if "K" not in sample:
        return {}
    return {"K": sample["K"].tolist(), "R": sample["R"].tolist(), "t": sample["t"].reshape(-1, 3)[frame].tolist()}


def _of_person(sample: Sample, who: int, frame: int) -> dict[str, Any]:
    """The number of the walker, who is person 0, and anybody's joints in a frame, if the sample has them."""
    known = {"walker": int(sample["walker"])} if who == 0 else {}
    name = "joints" if who == 0 else "others_joints"
    if name in sample:
        every = sample[name] if who == 0 else sample[name][who - 1]
        known["joints"] = np.round(every.reshape(-1, 15, 3)[frame], 5).tolist()
    return known


def _annotation(mask: np.ndarray, pixels: np.ndarray, seen: np.ndarray, face: np.ndarray) -> dict[str, Any]:
    """Outline, box, area and keypoints of somebody who is seen in `mask` (height, width)."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    left, top = int(columns[0]), int(rows[0])
    markers = np.column_stack([np.where(seen[:, None] > 0, np.round(pixels, 2), 0), seen])
    face = np.where(face[:, 2:] > 0, np.round(face, 2), 0)
    keypoints = np.concatenate([face, markers[_BODY]])
    return {
        "bbox": [left, top, int(columns[-1]) - left + 1, int(rows[-1]) - top + 1], "area": int(mask.sum()),
        "segmentation": {"size": list(mask.shape), "counts": run_lengths(mask)},
        "num_keypoints": int((keypoints[:, 2] > 0).sum()), "keypoints": _numbers(keypoints),
        "markers": _numbers(markers),
    }  # fmt: skip


def run_lengths(mask: np.ndarray) -> list[int]:
    """COCO's uncompressed run lengths of a `mask` (height, width): column by column, beginning with unset pixels."""
    flat = np.concatenate([[False], mask.T.reshape(-1)])
    edges = np.flatnonzero(np.diff(flat.astype(np.int8)))
    return np.diff(np.concatenate([[0], edges, [mask.size]])).tolist()


def _numbers(rows: np.ndarray) -> list[float]:
    """(x, y, v) of each point in a row, whole numbers without a fraction."""
    return [int(value) if value == int(value) else float(value) for value in rows.reshape(-1)]
