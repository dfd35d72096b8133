"""One training of a policy from feedback, judged, kept, and watched."""
