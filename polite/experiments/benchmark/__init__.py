"""A grid of runs, each one process and one record."""
