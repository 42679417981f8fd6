"""Walking people with known ground truth: see README.md."""
