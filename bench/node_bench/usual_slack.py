"""rigid_body_node with the timer slack that Linux gives to everybody: to show what the node's own buys."""

import sys

from rigid_body_sim.ros import main, realtime

USUAL_NS = 50_000

if __name__ == "__main__":
    realtime.TIMER_SLACK_NS = USUAL_NS
    sys.exit(main.main())
