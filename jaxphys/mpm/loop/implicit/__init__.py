"""The loop of implicit steps: passes over particles, nodes, Newton's method, one step, many."""
