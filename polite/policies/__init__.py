"""stable-baselines3 behind one small door."""
