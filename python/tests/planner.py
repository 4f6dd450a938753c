"""A planner of twenty lines: to the goal, and to the right of robots ahead. As a script it is an agent."""

import numpy as np

import shoal


def plan(view):
    ahead = view.goal - view.position
    distance = np.hypot(*ahead)
    if view.arrived or distance < 1e-9:
        return 0.0, 0.0
    velocity = ahead / distance * min(view.limits.speed_mps_max, distance / view.dt_s)
    offsets = view.neighbors.position - view.position
    gaps = np.hypot(offsets[:, 0], offsets[:, 1]) - view.neighbors.radius_m - view.radius_m
    if np.any((gaps < 1.0) & (offsets @ ahead > 0.0)):
        cos, sin = np.cos(-0.9), np.sin(-0.9)
        velocity = np.array([cos * velocity[0] - sin * velocity[1], sin * velocity[0] + cos * velocity[1]])
    return velocity


if __name__ == "__main__":
    shoal.run(plan)
