"""Readers of motion capture files, one module per format.

They are imported by whoever reads: `text` alone serves marker maps, which some of the readers need.
"""

__all__ = ["amass", "asfamc", "bvh", "c3d", "tables", "trc"]
