"""A renderer of OpenGL, by pyrender: the reference for looks, and a peer for speed."""
