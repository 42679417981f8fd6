"""Build the scene for pyrender: limb meshes, ground, sky, two lights, and a camera."""

import numpy as np

from motionenv.body import LIMBS, limb_segments, rounded_cone
from motionenv.body.gaps import known_limbs
from motionenv.render.opengl.engine import load
from motionenv.render.scene import Scene, linear
from motionenv.types import Camera, Skeleton

#: OpenGL's cameras look along -z with y up.
_FLIP = np.diag([1.0, -1.0, -1.0])
_SECTIONS, _RINGS = 64, 20  # the coarsest meshes that agree with the ray caster
_NEAR, _FAR = 0.05, 300.0
_REACH = 120.0  # radius of ground and sky [m]


class GlScene:
    """pyrender's scene for one skeleton, and `ids`, node → limb id, for the segmentation pass."""

    def __init__(self, skeleton: Skeleton, scene: Scene) -> None:
        self._skeleton, self._scene = skeleton, scene
        self.pyrender = _scene_class()(bg_color=[*scene.horizon, 1.0], ambient_light=np.array(scene.ambient))
        self.pyrender.scale = 1.1 * skeleton.height
        rest = limb_segments(np.zeros(25), skeleton)
        lengths = np.linalg.norm(rest[:, 1] - rest[:, 0], axis=-1)
        self._limbs = [
            self._add(_limb(length, radii, colour), casts_shadow=True)
            for length, radii, colour in zip(lengths, skeleton.radii, scene.limb_colours, strict=True)
        ]
        self.ids = {node: i + 1 for i, node in enumerate(self._limbs)}
        self._scenery = [self._add(_sky(scene))] + ([self._add(_ground(scene))] if scene.ground else [])
        for direction, radiance, casts in ((scene.key, scene.key_light, True), (scene.fill, scene.fill_light, False)):
            _add_light(self.pyrender, direction, radiance, casts)
        self._camera = self.pyrender.add(_camera_class()(znear=_NEAR, zfar=_FAR))

    def _add(self, primitive, casts_shadow: bool = False):
        node = self.pyrender.add(load().Mesh([primitive]))
        node.casts_shadow, node.shown = casts_shadow, True
        return node

    def pose(self, pose: np.ndarray) -> None:
        """Move the limbs to `pose` (25,) [m, rad], and hide those that are unknown."""
        ends, known = limb_segments(pose, self._skeleton), known_limbs(pose)
        for node, (start, end), shown in zip(self._limbs, ends, known, strict=True):
            node.mesh.is_visible = node.shown = bool(shown)
            if shown:
                self.pyrender.set_pose(node, _placed(start, _along(end - start)))
        if known.any():
            self.pyrender.centroid = ends[LIMBS.index("pelvis")].mean(0)

    def look(self, camera: Camera) -> None:
        """Set the camera; ground and sky move with it, by whole pairs of tiles."""
        self._camera.camera.K = camera.K
        self._camera.camera.size = camera.width, camera.height
        self.pyrender.set_pose(self._camera, _placed(camera.centre, camera.R.T @ _FLIP))
        period = 2 * self._scene.tile
        x, y, z = camera.centre
        sky, *ground = self._scenery
        self.pyrender.set_pose(sky, _placed((x, y, z), np.eye(3)))
        for node in ground:
            self.pyrender.set_pose(
                node, _placed((period * round(x / period), period * round(y / period), 0), np.eye(3))
            )


def _placed(position, rotation) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, position
    return pose


def _along(axis: np.ndarray) -> np.ndarray:
    """A rotation (3, 3) whose z axis is along `axis` (3,); arbitrary if that has no length."""
    length = np.linalg.norm(axis)
    if length < 1e-9:
        return np.eye(3)
    z = axis / length
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


def _material(colour, **more):
    """A rough dielectric, as in the ray caster; `colour` is linear."""
    kind = load().MetallicRoughnessMaterial
    return kind(baseColorFactor=[*colour, 1.0], metallicFactor=0.0, roughnessFactor=1.0, **more)


def _limb(length: float, radii, colour):
    """A rounded cone along z, as a primitive."""
    mesh = rounded_cone(length, radii[0], radii[1], _SECTIONS, _RINGS)
    return load().Primitive(mesh.vertices, mesh.normals, indices=mesh.faces, mode=4, material=_material(colour))


def _rings(radii, sections: int = 48) -> tuple[np.ndarray, np.ndarray]:
    """Rings of unit directions around z, scaled by `radii` (n,): points (n, sections, 2) and faces between them."""
    angle = np.linspace(0, 2 * np.pi, sections, endpoint=False)
    points = np.asarray(radii)[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], -1)
    i, j = np.meshgrid(np.arange(len(radii) - 1), np.arange(sections), indexing="ij")
    k = (j + 1) % sections
    a, b, c, d = i * sections + j, i * sections + k, (i + 1) * sections + j, (i + 1) * sections + k
    return points, np.stack([a, c, d, a, d, b], -1).reshape(-1, 3)


def _ground(scene: Scene):
    """A checkered disc that becomes transparent with distance, like the ray caster's ground."""
    pyrender = load()
    radii = np.concatenate([[0.0], np.geomspace(0.5, _REACH, 40)])
    points, faces = _rings(radii)
    xy = points.reshape(-1, 2)
    seen = np.repeat(scene.fade**2 / (radii**2 + scene.fade**2), points.shape[1])
    colours = np.column_stack([np.ones((len(xy), 3)), seen])
    one, other = (np.rint(255 * np.array(tile)).astype(np.uint8) for tile in scene.tiles)
    pattern = np.array([[other, one], [one, other]]).repeat(32, 0).repeat(32, 1)
    linear_mipmaps = pyrender.Sampler(magFilter=9729, minFilter=9987)  # GL_LINEAR, GL_LINEAR_MIPMAP_LINEAR
    texture = pyrender.Texture(source=pattern, source_channels="RGB", sampler=linear_mipmaps)
    return pyrender.Primitive(
        np.column_stack([xy, np.zeros(len(xy))]), np.tile([0.0, 0.0, 1.0], (len(xy), 1)),
        texcoord_0=xy / (2 * scene.tile), color_0=colours, indices=faces, mode=4,
        material=_material((1, 1, 1), baseColorTexture=texture, alphaMode="BLEND"),
    )  # fmt: skip


def _sky(scene: Scene):
    """An emissive dome seen from inside, with black albedo so that lights have no effect."""
    elevation = np.linspace(-1, 1, 25) ** 3 * np.pi / 2
    points, faces = _rings(np.cos(elevation))
    n = points.shape[1]
    up = np.repeat(np.sin(elevation), n)
    rise = 1 - (1 - np.abs(up)) ** 3
    horizon, zenith = linear(scene.horizon), linear(scene.zenith)
    colours = np.column_stack([horizon + rise[:, None] * (zenith - horizon), np.ones(len(up))])
    return load().Primitive(
        0.9 * _REACH * np.column_stack([points.reshape(-1, 2), up]),
        np.tile([0.0, 0.0, -1.0], (len(up), 1)),  # away from both lights
        color_0=colours,
        indices=faces,
        mode=4,
        material=_material((0, 0, 0), emissiveFactor=[1.0, 1.0, 1.0], doubleSided=True),
    )


def _add_light(scene, direction, radiance, casts: bool) -> None:
    """Add a light that shines from `direction`; pyrender's shine along their -z."""
    pyrender = load()
    light = pyrender.DirectionalLight(color=np.array(radiance) / max(radiance), intensity=max(radiance))
    light.casts = casts
    once = pyrender.Sampler(wrapS=33071, wrapT=33071)  # GL_CLAMP_TO_EDGE: by default the map repeats over the ground
    size, real = pyrender.constants.SHADOW_TEX_SZ, 5126  # GL_FLOAT
    light.shadow_texture = pyrender.Texture(
        width=size, height=size, source_channels="D", data_format=real, sampler=once
    )
    scene.add(light, pose=_placed((0, 0, 0), _along(np.array(direction))))


def _scene_class() -> type:
    """A pyrender scene whose shadow maps cover only the surroundings of the body."""

    class BodyScene(load().Scene):  # type: ignore[misc]
        """`centroid` (3,) and `scale` [m]: where the body is, and how far it reaches."""

        centroid = np.zeros(3)
        scale = 2.0

    return BodyScene


def _camera_class() -> type:
    """A pyrender camera with OpenCV's intrinsics `K` and image `size` (width, height)."""

    class Pinhole(load().Camera):  # type: ignore[misc]
        K = np.eye(3)
        size = (1, 1)

        def get_projection_matrix(self, width=None, height=None):
            """Clip coordinates from the camera's; pixel centres at whole numbers, so edges at -1/2."""
            n, f = self.znear, self.zfar
            to_ndc = np.array(
                [[2 / self.size[0], 0, 1 / self.size[0] - 1], [0, -2 / self.size[1], 1 - 1 / self.size[1]]]
            )
            P = np.zeros((4, 4))
            P[:2, :3] = to_ndc @ self.K @ _FLIP
            P[2, 2:] = (f + n) / (n - f), 2 * f * n / (n - f)
            P[3, 2] = -1
            return P

    return Pinhole
