"""Programs of developers: what things cost, other simulators, reference solutions, tables of the documentation."""
