"""Benchmark of rigid_body_node as a process over real DDS: ``make bench-node``; see docs/explanation/benchmarks.md."""
