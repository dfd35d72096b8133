"""Numbers from rewards, answers and policies: pure functions on arrays (NumPy and SciPy only)."""
