"""pyrender's scene of a body: limb meshes, ground, sky, two lights and a camera; and its renderer of that.

Import it in the OpenGL thread only, after `motionenv.render.opengl.engine.load`.
"""

import numpy as np
import pyrender
from pyrender.renderer import Renderer

from motionenv.body import LIMBS, limb_segments, rounded_cone
from motionenv.body.gaps import known_limbs
from motionenv.render.scene import Scene, linear
from motionenv.types import Camera, Skeleton

#: OpenGL's cameras look along -z with y up.
_FLIP = np.diag([1.0, -1.0, -1.0])
_SECTIONS, _RINGS = 64, 20  # the coarsest meshes that agree with the ray caster
_NEAR, _FAR = 0.05, 300.0
_REACH = 120.0  # radius of ground and sky [m]


class BodyScene(pyrender.Scene):
    """A scene of one skeleton. Shadow maps cover the body's surroundings only, `scale` [m] about `centroid` (3,)."""

    centroid, scale = np.zeros(3), 2.0

    def __init__(self, skeleton: Skeleton, scene: Scene) -> None:
        super().__init__(bg_color=[*scene.horizon, 1.0], ambient_light=np.array(scene.ambient))
        self.scale = 1.1 * skeleton.height
        self.shadows = scene.shadows and scene.ground
        self._skeleton, self._period = skeleton, 2 * scene.tile
        rest = limb_segments(np.zeros(25), skeleton)
        lengths = np.linalg.norm(rest[:, 1] - rest[:, 0], axis=-1)
        limbs = zip(lengths, skeleton.radii, scene.limb_colours, strict=True)
        self.limbs = [self.add(pyrender.Mesh([_limb(*limb)])) for limb in limbs]
        self.scenery = [self.add(pyrender.Mesh([_sky(scene)]))]
        if scene.ground:
            self.scenery.append(self.add(pyrender.Mesh([_ground(scene)])))
        self.key = self.add(_light(scene.key_light), pose=_towards(scene.key))
        self.add(_light(scene.fill_light), pose=_towards(scene.fill))
        self._camera = self.add(_Pinhole(znear=_NEAR, zfar=_FAR))

    def pose(self, pose: np.ndarray) -> None:
        """Move the limbs to `pose` (25,) [m, rad], and hide those that are unknown."""
        ends, known = limb_segments(pose, self._skeleton), known_limbs(pose)
        for node, (start, end), shown in zip(self.limbs, ends, known, strict=True):
            node.mesh.is_visible = bool(shown)
            if shown:
                self.set_pose(node, _placed(start, _along(end - start)))
        if known.any():
            self.centroid = ends[LIMBS.index("pelvis")].mean(0)

    def look(self, camera: Camera) -> None:
        """Set the camera; ground and sky move with it, by whole pairs of tiles."""
        self._camera.camera.seen_by = camera
        self.set_pose(self._camera, _placed(camera.centre, camera.R.T @ _FLIP))
        x, y, z = camera.centre
        sky, *ground = self.scenery
        self.set_pose(sky, _placed((x, y, z), np.eye(3)))
        x, y = (self._period * round(at / self._period) for at in (x, y))
        for node in ground:
            self.set_pose(node, _placed((x, y, 0), np.eye(3)))


class BodyRenderer(Renderer):
    """Only the body casts a shadow, and only in the key light."""

    def draw(self, scene: BodyScene, camera: Camera, *, ids: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Colours (height, width, 3), or limb ids in each channel, and depth (height, width) [m]."""
        scene.look(camera)
        self.viewport_width, self.viewport_height = camera.width, camera.height
        flags = pyrender.RenderFlags.OFFSCREEN
        if ids:
            numbers = {node: i + 1 for i, node in enumerate(scene.limbs)}
            return self.render(scene, flags | pyrender.RenderFlags.SEG, numbers)
        return self.render(scene, flags | (pyrender.RenderFlags.SHADOWS_DIRECTIONAL if scene.shadows else 0))

    def _shadow_mapping_pass(self, scene: BodyScene, light_node, flags) -> None:
        if light_node is not scene.key or not any(node.mesh.is_visible for node in scene.limbs):
            self._configure_shadow_mapping_viewport(light_node.light, flags)  # an empty map
            return
        for node in scene.scenery:
            node.mesh.is_visible = False
        super()._shadow_mapping_pass(scene, light_node, flags)
        for node in scene.scenery:
            node.mesh.is_visible = True

    def __del__(self):
        """Nothing: buffers may only be freed in the OpenGL thread, by `delete`."""


class _Pinhole(pyrender.Camera):
    """`seen_by` a camera of OpenCV's."""

    seen_by: Camera

    def get_projection_matrix(self, width=None, height=None):
        """Clip coordinates from the camera's; pixel centres at whole numbers, so edges at -1/2."""
        n, f, width, height = self.znear, self.zfar, self.seen_by.width, self.seen_by.height
        P = np.zeros((4, 4))
        P[:2, :3] = [[2 / width, 0, 1 / width - 1], [0, -2 / height, 1 - 1 / height]] @ self.seen_by.K @ _FLIP
        P[2, 2:] = (f + n) / (n - f), 2 * f * n / (n - f)
        P[3, 2] = -1
        return P


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


def _towards(direction) -> np.ndarray:
    """The pose of a light that shines from `direction`; pyrender's shine along their -z."""
    return _placed((0, 0, 0), _along(np.array(direction)))


def _material(colour, **more):
    """A rough dielectric, as in the ray caster; `colour` is linear."""
    kind = pyrender.MetallicRoughnessMaterial
    return kind(baseColorFactor=[*colour, 1.0], metallicFactor=0.0, roughnessFactor=1.0, **more)


def _limb(length: float, radii, colour):
    """A rounded cone along z, as a primitive."""
    mesh = rounded_cone(length, radii[0], radii[1], _SECTIONS, _RINGS)
    return pyrender.Primitive(mesh.vertices, mesh.normals, indices=mesh.faces, mode=4, material=_material(colour))


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
    return pyrender.Primitive(
        0.9 * _REACH * np.column_stack([points.reshape(-1, 2), up]),
        np.tile([0.0, 0.0, -1.0], (len(up), 1)),  # away from both lights
        color_0=colours,
        indices=faces,
        mode=4,
        material=_material((0, 0, 0), emissiveFactor=[1.0, 1.0, 1.0], doubleSided=True),
    )


def _light(radiance) -> pyrender.DirectionalLight:
    light = pyrender.DirectionalLight(color=np.array(radiance) / max(radiance), intensity=max(radiance))
    once = pyrender.Sampler(wrapS=33071, wrapT=33071)  # GL_CLAMP_TO_EDGE: by default the map repeats over the ground
    size, real = pyrender.constants.SHADOW_TEX_SZ, 5126  # GL_FLOAT
    light.shadow_texture = pyrender.Texture(
        width=size, height=size, source_channels="D", data_format=real, sampler=once
    )
    return light
