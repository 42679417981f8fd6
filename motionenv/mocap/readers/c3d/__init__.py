"""C3D: binary optical marker data with analog channels (the C3D file format user guide, c3d.org)."""

from motionenv.mocap.readers.c3d.reader import read

__all__ = ["read"]
