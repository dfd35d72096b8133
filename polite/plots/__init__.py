"""Figures: each function takes an Axes (or a Figure) and a part of results.json, and draws."""
