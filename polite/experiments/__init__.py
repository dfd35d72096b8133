"""Whole experiments: the user-study replication and what runs it."""
