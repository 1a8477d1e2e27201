"""Adapters of other simulators, NAME_peer.py each; rigid_body_sim.report.peers says what one is, and finds them.

Each is driven as its users would, in its compiled form where it has one, with the wrench evaluated at the stages where
that is possible. What pip installs for them is also the extra ``peers``.
"""
