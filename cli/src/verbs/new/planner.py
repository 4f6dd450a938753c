"""The planner of the robots in fleet.toml: to the goal, and to the right of what is in the way.

In this directory, `shoal run fleet.toml --view` runs it in a process for each robot. In a notebook, all robots in one thread:
`import shoal, planner; shoal.simulate("fleet.toml", planner.plan)`.
"""

import sys

try:
    import numpy as np
    import shoal
except ModuleNotFoundError as error:
    sys.exit(
        f"error: Python `{sys.executable}` has no module `{error.name}`\n"
        "hint: install the wheel `shoal-fleet` for this Python, or activate the environment that has it"
    )

# A turn to the right by about 53 degrees.
RIGHT = np.array([[0.6, 0.8], [-0.8, 0.6]])


def plan(view):
    """Called once a tick for each robot, with what the robot sees; returns its velocity in the world frame, m/s."""
    ahead = view.goal - view.position
    distance = np.hypot(*ahead)
    if view.arrived or distance < 1e-9:
        return 0.0, 0.0
    # To the goal at full speed, but not past it within this tick.
    velocity = ahead / distance * min(view.limits.speed_mps_max, distance / view.dt_s)
    # Robots are discs. An obstacle is a segment from `a` to `b` with a radius: its nearest point counts.
    robots, obstacles = view.neighbors, view.obstacles
    along = obstacles.b - obstacles.a
    share = ((view.position - obstacles.a) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-12)
    nearest = obstacles.a + np.clip(share, 0.0, 1.0)[:, None] * along
    # All of them as seen from here, and the gaps from surface to surface, m.
    offsets = np.vstack([robots.position, nearest]) - view.position
    gaps = np.hypot(*offsets.T) - np.concatenate([robots.radius_m, obstacles.radius_m]) - view.radius_m
    if np.any((gaps < 1.0) & (offsets @ ahead > 0.0)):
        velocity = RIGHT @ velocity
    return velocity


if __name__ == "__main__":
    shoal.run(plan)
