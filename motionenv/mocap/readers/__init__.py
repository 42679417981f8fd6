"""Readers of motion capture files, one module per format."""

from motionenv.mocap.readers import asfamc, bvh, c3d, trc

__all__ = ["asfamc", "bvh", "c3d", "trc"]
