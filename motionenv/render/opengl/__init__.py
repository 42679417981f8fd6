"""The pyrender engine: OpenGL, the visual reference."""

from motionenv.render.opengl.engine import PyrenderRenderer

__all__ = ["PyrenderRenderer"]
