"""Reward models: the network, its training, and an ensemble of several."""
