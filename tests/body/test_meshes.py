"""Meshes of the limbs against the definition (all points within a radius of the axis) and against SciPy's hulls."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from motionenv.body import LIMBS, body_mesh, forward, from_height, limb_meshes, limb_segments, rounded_cone
from motionenv.body.limbs import CLOTHES, LIMB_SEGMENT
from motionenv.body.skeleton import SEGMENT_ORIGIN
from motionenv.errors import GapError, MotionError

SIZES = st.floats(0.01, 0.3)


def distance(points, ends, radii):
    """Signed distance to the union of all balls whose centre and radius slide from one end to the other."""
    along = np.linspace(0, 1, 1001)[:, None]
    centres = ends[0] + along * (ends[1] - ends[0])
    r = radii[0] + along[:, 0] * (radii[1] - radii[0])
    return (np.linalg.norm(points[:, None] - centres, axis=-1) - r).min(1)


def as_trimesh(mesh):
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)


@settings(max_examples=40)
@given(length=st.floats(0, 0.6), start=SIZES, end=SIZES, sections=st.integers(3, 40))
def test_closed_outwards_and_on_the_surface(length, start, end, sections):
    mesh = rounded_cone(length, start, end, sections)
    surface = as_trimesh(mesh)
    assert surface.is_watertight
    assert surface.is_winding_consistent
    assert surface.volume > 0
    assert len(surface.split()) == 1
    ends = np.array([[0, 0, 0], [0, 0, length]])
    np.testing.assert_allclose(distance(mesh.vertices, ends, (start, end)), 0, atol=5e-6)
    outside = distance(mesh.vertices + 1e-3 * mesh.normals, ends, (start, end))
    np.testing.assert_allclose(outside, 1e-3, atol=5e-6)


@pytest.mark.parametrize(("length", "start", "end"), [(0.4, 0.05, 0.03), (0.1, 0.02, 0.07), (0.2, 0.04, 0.04)])
def test_tends_to_the_hull_of_two_spheres(length, start, end):
    sphere = trimesh.creation.icosphere(subdivisions=5).vertices
    hull = ConvexHull(np.concatenate([start * sphere, end * sphere + [0, 0, length]]))
    volumes = [as_trimesh(rounded_cone(length, start, end, n)).volume for n in (32, 64, 128)]
    np.testing.assert_allclose(volumes[2], hull.volume, rtol=2e-3)
    missing = hull.volume * 1.0003 - np.array(volumes)  # the hull itself lacks about 0.03 %
    assert missing[0] > 3 * missing[1] > 0  # second order in the step


def test_faces_are_as_fine_as_the_circle():
    mesh = as_trimesh(rounded_cone(0.0, 0.1, 0.1, 64))
    assert mesh.vertices.shape == (2 + 31 * 64, 3)
    assert mesh.edges_unique_length.max() <= 1.001 * np.sqrt(2) * 0.1 * 2 * np.pi / 64


@pytest.mark.parametrize("arguments", [(1, 0.1, 0.1, 2), (-1, 0.1, 0.1), (1, 0, 0.1), (1, 0.1, np.nan), (np.nan, 1, 1)])
def test_says_what_it_needs(arguments):
    with pytest.raises(MotionError, match="sections must be at least 3"):
        rounded_cone(*arguments)


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1), height=st.floats(1.2, 2.1), girth=st.floats(0.5, 2))
def test_limbs_lie_where_kinematics_draws_them(seed, height, girth):
    skeleton = from_height(height, girth=girth)
    pose = np.random.default_rng(seed).normal(0, 0.6, 25)
    nodes, rotations = forward(pose, skeleton)
    ends = limb_segments(pose, skeleton)
    for limb, mesh in enumerate(limb_meshes(skeleton, 8)):
        s = LIMB_SEGMENT[limb]
        placed = mesh.vertices @ rotations[s].T + nodes[SEGMENT_ORIGIN[s]]
        radii = skeleton.radii[limb]
        np.testing.assert_allclose(distance(placed, ends[limb], radii), 0, atol=1e-5, err_msg=LIMBS[limb])
        axis = ends[limb, 1] - ends[limb, 0]
        span = (placed @ axis) / np.linalg.norm(axis)
        np.testing.assert_allclose(np.ptp(span), np.linalg.norm(axis) + radii.sum(), atol=1e-9)


def test_whole_body_stands_on_the_ground():
    skeleton = from_height(1.8)
    pose = np.zeros(25)
    pose[2] = (0.245 + 0.246 + 0.039) * 1.8
    mesh = body_mesh(pose, skeleton)
    assert mesh.is_watertight
    np.testing.assert_allclose(mesh.bounds[:, 2], [0, 1.8], atol=0.02)
    colours = {tuple(c) for c in mesh.visual.vertex_colors}
    assert len(colours) == len(set(CLOTHES)) == 5
    left = mesh.vertices[:, 1].max()
    assert -mesh.vertices[:, 1].min() == pytest.approx(left)
    with pytest.raises(MotionError, match=r"one pose \(25,\)"):
        body_mesh(np.full(25, np.inf), skeleton)
    pose[6:17] = np.nan  # a lower body: nothing above the pelvis
    hips = LIMBS.index("pelvis")
    top = limb_segments(pose, skeleton)[hips, 0, 2] + skeleton.radii[hips, 0]
    assert body_mesh(pose, skeleton).bounds[1, 2] == pytest.approx(top)
    with pytest.raises(GapError, match="no limb"):
        body_mesh(np.full(25, np.nan), skeleton)
