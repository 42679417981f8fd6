"""The 25-DOF body of tapered cylinders: structure, kinematics, meshes, and fitting to points (paper A, fig. 1)."""

from motionenv.body.kinematics import feet, forward, limb_segments, markers
from motionenv.body.limbs import LIMBS, from_height, limb_radii
from motionenv.body.meshes import body_mesh, limb_meshes, rounded_cone
from motionenv.body.skeleton import EDGES, LIMITS, NODES, SEGMENTS, limit_excess, mirror

__all__ = [
    "EDGES", "LIMBS", "LIMITS", "NODES", "SEGMENTS", "body_mesh", "feet", "forward", "from_height", "limb_meshes",
    "limb_radii", "limb_segments", "limit_excess", "markers", "mirror", "rounded_cone",
]  # fmt: skip
