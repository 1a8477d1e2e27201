"""What stands on the node and the simulation: the demo and its controller, and what simulates bags again."""
