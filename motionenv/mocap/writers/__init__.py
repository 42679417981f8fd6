"""Writers of motions, one module per format."""

from motionenv.mocap.writers import bvh, c3d, csv, glb, mot, trc

__all__ = ["bvh", "c3d", "csv", "glb", "mot", "trc"]
