"""Readers of motion capture files, one module per format."""

from motionenv.mocap.readers import amass, asfamc, bvh, c3d, trc

__all__ = ["amass", "asfamc", "bvh", "c3d", "trc"]
