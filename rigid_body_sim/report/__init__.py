"""The report: how exact and how fast the integrators and other simulators are."""
