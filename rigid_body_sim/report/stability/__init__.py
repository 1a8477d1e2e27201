"""Where each integrator is stable and accurate, where it is wrong, and where it gives up: maps and long runs."""
