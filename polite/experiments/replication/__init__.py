"""The user-study replication: from the corridor to the report."""
