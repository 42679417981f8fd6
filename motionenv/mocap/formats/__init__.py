"""Motion capture file formats, one module per reader or writer."""

from motionenv.mocap.formats import asfamc, bvh, bvh_writer, c3d, c3d_writer, csv_writer, glb, npz, trc

__all__ = ["asfamc", "bvh", "bvh_writer", "c3d", "c3d_writer", "csv_writer", "glb", "npz", "trc"]
