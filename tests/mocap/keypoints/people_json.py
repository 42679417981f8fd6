"""Detections of people as COCO's JSON has them, for the tests of keypoints."""

import json

import numpy as np

import motionenv
from motionenv.mocap.keypoints.skeletons import KEYPOINT_SETS
from motionenv.types import MARKERS


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


def walker(name="coco-17", frames=20, shift=0.0, score=0.9) -> np.ndarray:
    """Keypoints (frames, n, 3) in pixels of a synthesised walker who goes to the right, of the set `name`."""
    motion = motionenv.synthesize("walk/fpca", seconds=frames / 25, fps=25, seed=3)
    world = motionenv.markers(motion.poses, motion.skeleton)
    seen = np.stack([world[..., 0] + 0.3 * world[..., 1], -world[..., 2]], axis=-1) * 200 + [300 + shift, 500]
    at = dict(zip(MARKERS, np.moveaxis(seen, 1, 0), strict=True))
    head, neck = at["head"], (at["left_shoulder"] + at["right_shoulder"]) / 2
    top = (head - 0.4 * neck) / 0.6
    at |= {"left_ear": head + np.array([3, 0]), "right_ear": head - [3, 0], "neck": neck, "head_top": top}
    at |= {"upper_neck": 2 * head - top, "mid_hip": (at["left_hip"] + at["right_hip"]) / 2, "thorax": at["sternum"]}
    known = KEYPOINT_SETS[name]
    names = known.keypoints
    others = {key: at[f"{key.split('_')[0]}_ankle"] + [20, 10] for key in names if "toe" in key or "heel" in key}
    face = head + np.array([20, 0])
    xy = np.stack([at.get(key, others.get(key, face)) for key in names], axis=1)
    return np.concatenate([xy, np.full((*xy.shape[:2], 1), score)], axis=-1)


def expected(name="coco-17", frames=20, shift=0.0) -> np.ndarray:
    """The markers (frames, 15, 2) of `walker`; the sternum by its definition from shoulders and hips."""
    k = dict(zip(KEYPOINT_SETS[name].keypoints, np.moveaxis(walker(name, frames, shift)[..., :2], 1, 0), strict=False))
    shoulders, hips = ((k[f"left_{part}"] + k[f"right_{part}"]) / 2 for part in ("shoulder", "hip"))
    ears = (k["left_ear"] + k["right_ear"]) / 2 if "left_ear" in k else (k["head_top"] + k["upper_neck"]) / 2
    made = {"head": ears, "sternum": 0.885 * shoulders + 0.115 * hips, "pelvis": hips}
    return np.stack([made.get(marker, k.get(marker)) for marker in MARKERS], axis=1)
