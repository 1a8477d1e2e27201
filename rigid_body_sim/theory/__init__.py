"""The theory chapter on arrays: what a textbook states and no kernel needs."""
