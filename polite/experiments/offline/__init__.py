"""Forms of highlights compared without reinforcement learning: fixed segments, many seeds."""
