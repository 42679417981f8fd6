"""Models of motion cycles: functional PCA (paper A), eigenwalkers (paper B), and how they are stored."""
