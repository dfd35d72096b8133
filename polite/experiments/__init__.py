"""Whole experiments: trainings, grids of them, the replication, new studies; and what runs them."""
