"""What a bag tells of a run: where it starts, and which commands took effect at which step. Nothing is simulated."""
