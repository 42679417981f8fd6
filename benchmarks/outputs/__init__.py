"""Outputs of the library for fixed inputs, compared before and after a change."""
