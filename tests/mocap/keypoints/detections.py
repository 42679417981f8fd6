"""Detections of people as COCO's JSON has them, for the tests of keypoints."""

import json

import numpy as np


def person(x=200.0, score=0.9) -> list[float]:
    """One detection of a standing person."""
    where = np.array([[x + 3 * i, 100.0 + 10 * i] for i in range(17)])
    return np.column_stack([where, np.full(17, score)]).ravel().tolist()


def results(frames=10, **changes) -> list[dict]:
    return [
        {"image_id": i, "category_id": 1, "keypoints": person(200 + i), "score": 0.9, **changes} for i in range(frames)
    ]


def saved(tmp_path, content, name="a.json") -> str:
    path = tmp_path / name
    path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    return str(path)
