"""Ways to train a policy from feedback: one loop, and what it is made of."""
