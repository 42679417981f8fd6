"""The simulated world of the environments: motion, cameras, images, and scoring."""
