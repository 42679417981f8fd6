"""Triangle meshes of the drawn limbs: convex hulls of two spheres, i.e. tapered cylinders with round ends."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from motionenv.body.gaps import known_limbs
from motionenv.body.kinematics import forward
from motionenv.body.limbs import CLOTHES, COLOURS, LIMB_NODES, LIMB_SEGMENT, limb_shifts
from motionenv.body.skeleton import SEGMENT_ORIGIN
from motionenv.errors import GapError, MotionError
from motionenv.types import Skeleton

if TYPE_CHECKING:
    import trimesh


class Mesh(NamedTuple):
    """A closed surface."""

    vertices: np.ndarray  # (n, 3) [m]
    normals: np.ndarray  # (n, 3), the unit normals of the round surface at the vertices, outwards
    faces: np.ndarray  # (m, 3) indices of vertices, counter-clockwise seen from outside


def rounded_cone(
    length: float, start_radius: float, end_radius: float, sections: int = 32, rings: int | None = None
) -> Mesh:
    """The convex hull of a sphere at the origin and one at (0, 0, length).

    A cone touches both spheres where their normals are equal: at the latitude whose sine is the difference of the radii
    over the length. Below it the surface is the first sphere, above it the second. All vertices lie exactly on the
    surface, so the mesh lies inside of it.

    Args:
        length: distance of the centres [m].
        start_radius, end_radius: of the sphere at the origin and of the other one [m].
        sections: number of vertices around the axis.
        rings: number of latitude steps from pole to pole; None makes the caps as fine along the axis as around it.

    Raises:
        MotionError: fewer than three sections, a negative length, or a radius that isn't above 0.
    """
    if sections < 3 or not 0 <= length < np.inf or not (0 < start_radius < np.inf and 0 < end_radius < np.inf):
        raise MotionError(
            "sections must be at least 3, length at least 0 and radii above 0, "
            f"got {sections!r}, {length!r}, {start_radius!r}, {end_radius!r}"
        )
    latitude, centre, radius = _profile(length, start_radius, end_radius, rings or max(sections // 2, 2))
    longitude = 2 * np.pi * np.arange(sections) / sections
    around = np.stack([np.cos(longitude), np.sin(longitude), np.zeros(sections)], axis=-1)
    normals_by_ring = np.cos(latitude)[:, None, None] * around + np.sin(latitude)[:, None, None] * [0.0, 0.0, 1.0]
    normals = np.concatenate([[[0.0, 0.0, -1.0]], normals_by_ring.reshape(-1, 3), [[0.0, 0.0, 1.0]]])
    repeats = [1, *[sections] * len(latitude), 1]
    centres = np.repeat([centre[0], *centre, centre[-1]], repeats)
    radii = np.repeat([radius[0], *radius, radius[-1]], repeats)
    vertices = radii[:, None] * normals
    vertices[:, 2] += centres
    return Mesh(vertices, normals, _faces(len(latitude), sections))


def _profile(length, start_radius, end_radius, rings) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Latitude [rad], height of the sphere's centre [m] and its radius [m] for each ring between the poles."""
    if abs(start_radius - end_radius) >= length:  # one sphere contains the other
        touch = np.pi / 2 if start_radius >= end_radius else -np.pi / 2
    else:
        touch = np.arcsin((start_radius - end_radius) / length)
    below, above = (math.ceil((np.pi / 2 + sign * touch) / np.pi * rings) for sign in (1, -1))
    first = np.linspace(-np.pi / 2, touch, below + 1)[1 : None if above else -1]
    second = np.linspace(touch, np.pi / 2, above + 1)[0 if below else 1 : -1]
    of = np.repeat([0, 1], [len(first), len(second)])
    centre, radius = np.array([0.0, length]), np.array([start_radius, end_radius])
    return np.concatenate([first, second]), centre[of], radius[of]


def _faces(rings: int, sections: int) -> np.ndarray:
    """Triangles (m, 3) between a pole (vertex 0), rings of vertices upwards, and the other pole (the last vertex)."""
    here = np.arange(sections)
    after = (here + 1) % sections
    start = 1 + sections * np.arange(rings - 1)[:, None]
    a, b, c, d = start + here, start + after, start + sections + here, start + sections + after
    last = 1 + sections * (rings - 1)
    pole = np.zeros(sections, dtype=int)
    bottom = np.stack([pole, 1 + after, 1 + here], axis=-1)
    top = np.stack([pole + last + sections, last + here, last + after], axis=-1)
    sides = np.stack([a, b, d, a, d, c], axis=-1).reshape(-1, 3)
    return np.concatenate([bottom, sides, top])


def limb_meshes(skeleton: Skeleton, sections: int = 32) -> list[Mesh]:
    """The drawn limbs of a `skeleton` in the order of `motionenv.body.LIMBS`, each in the frame of its segment.

    To pose them, rotate vertices by the rotations of `motionenv.body.forward`, then translate them by the position of
    the segment's origin, the node `motionenv.body.skeleton.SEGMENT_ORIGIN`. There are `sections` vertices around each.

    Raises:
        MotionError: fewer than three sections.
    """
    meshes = []
    for limb, (segment, nodes, shifts) in enumerate(zip(LIMB_SEGMENT, LIMB_NODES, limb_shifts(skeleton), strict=True)):
        own = nodes == SEGMENT_ORIGIN[segment]
        start, end = np.where(own[:, None], 0.0, skeleton.offsets[nodes]) + shifts
        length = float(np.linalg.norm(end - start))
        cone = rounded_cone(length, skeleton.radii[limb, 0], skeleton.radii[limb, 1], sections)
        turn = _frame_along(end - start)
        meshes.append(Mesh(cone.vertices @ turn.T + start, cone.normals @ turn.T, cone.faces))
    return meshes


def _frame_along(axis: np.ndarray) -> np.ndarray:
    """A rotation (3, 3) that turns z into the direction of `axis` (3,)."""
    length = np.linalg.norm(axis)
    z = axis / length if length else np.array([0.0, 0.0, 1.0])
    x = np.cross(np.eye(3)[(np.argmax(np.abs(z)) + 1) % 3], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=-1)


def body_mesh(pose: ArrayLike, skeleton: Skeleton, sections: int = 32) -> trimesh.Trimesh:
    """The whole body in one pose as a coloured `trimesh.Trimesh` [m], to display, measure or export (STL, PLY, OBJ).

    Limbs are closed surfaces that overlap at the joints.

    Args:
        pose: (25,) [m, rad], in the order of `motionenv.types.POSE`; limbs whose angles are NaN are left out.
        skeleton: the body.
        sections: number of vertices around each limb.

    Raises:
        MotionError: `pose` has another shape or infinite values.
        GapError: no limb is known.
    """
    import trimesh

    pose = np.asarray(pose, dtype=np.float64)
    if pose.shape != (25,) or np.isinf(pose).any():
        raise MotionError(f"pose must be one pose (25,), NaN where unknown, got {pose!r}")
    known = known_limbs(pose)
    if not known.any():
        raise GapError("no limb of this pose is known: choose another frame, or fill the motion with motionenv.fill")
    nodes, rotations = forward(pose, skeleton)
    parts: list[list[np.ndarray]] = [[], [], [], []]
    limbs = zip(CLOTHES, LIMB_SEGMENT, limb_meshes(skeleton, sections), known, strict=True)
    for worn, segment, mesh in ((worn, segment, mesh) for worn, segment, mesh, shown in limbs if shown):
        first = sum(map(len, parts[0]))
        parts[0].append(mesh.vertices @ rotations[segment].T + nodes[SEGMENT_ORIGIN[segment]])
        parts[1].append(mesh.faces + first)
        parts[2].append(mesh.normals @ rotations[segment].T)
        parts[3].append(np.tile(np.uint8(np.round(255 * np.array(COLOURS[worn]))), (len(mesh.vertices), 1)))
    vertices, faces, normals, colours = map(np.concatenate, parts)
    return trimesh.Trimesh(vertices, faces, vertex_normals=normals, vertex_colors=colours, process=False)
