"""What a rigid body is: attitude, inertia, state, wrench, forces and invariants."""
