"""A database of motion as a probability distribution: the tree of paper C, and beyond it."""

__all__: list[str] = []
