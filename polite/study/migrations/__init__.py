"""Steps from one version of the schema to the next; a step adds and changes, never drops."""
