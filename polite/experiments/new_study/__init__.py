"""A study with people, made: its clips, its pairs, its `study.toml`."""
