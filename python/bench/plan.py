"""The cost of plans in Python beside Rust: the same scenes, interleaved, medians of several rounds.

A plan is timed as `simulate` times it: the whole run in one thread, divided by robots and ticks. The difference between a planner
in Python and the planner `straight`, which plans the same motion in Rust, is what Python costs."""

import platform
import statistics
import sys
import time

import numpy as np

import shoal

ROUNDS = 5
TICKS = 400


def scene(robots):
    """A grid of robots that all hear each other and stand near their goals for the whole run."""
    side = int(np.ceil(np.sqrt(robots)))
    places = [(3.0 * (i % side), 3.0 * (i // side)) for i in range(robots)]
    far = 3.0 * side + 60
    return {
        "world": {"x_m": [-far, far], "y_m": [-far, far]},
        "clock": {"tick_hz": 50, "duration_s": TICKS / 50, "stop": "duration"},
        "defaults": {"radio_range_m": 1000.0, "speed_mps_max": 0.5, "filter": "none", "planner": "straight"},
        "robot": [{"id": f"r{i:03}", "start_m": [x, y], "goal_m": [x + 50.0, y]} for i, (x, y) in enumerate(places)],
    }


def nothing(view):
    return 0.5, 0.0


def straight(view):
    """What `straight` does, without neighbours."""
    ahead = view.goal - view.position
    distance = np.hypot(ahead[0], ahead[1])
    return ahead * (min(view.limits.speed_mps_max, distance / view.dt_s) / max(distance, 1e-9))


def keep_right(view):
    """To the goal, and to the right of robots ahead: looks at all neighbours."""
    ahead = view.goal - view.position
    distance = np.hypot(ahead[0], ahead[1])
    velocity = ahead * (min(view.limits.speed_mps_max, distance / view.dt_s) / max(distance, 1e-9))
    offsets = view.neighbors.position - view.position
    gaps = np.hypot(offsets[:, 0], offsets[:, 1]) - view.neighbors.radius_m - view.radius_m
    if ((gaps < 1.0) & (offsets @ ahead > 0.0)).any():
        velocity = velocity @ np.array([[0.62, -0.78], [0.78, 0.62]])
    return velocity


def everything(view):
    """Asks for every array of the neighbours."""
    others = view.neighbors
    arrays = (others.id, others.position, others.velocity, others.yaw_rad, others.radius_m, others.age_s, others.remaining_m)
    arrays += (others.arrived, others.stopped, others.next, view.position, view.velocity, view.goal)
    return 0.5, 0.0


def per_robot_tick_us(scenario, plan):
    begun = time.process_time()
    result = shoal.simulate(scenario, plan, trajectories=False)
    took = time.process_time() - begun
    return took / (len(scenario.robots) * result.report["ticks"]) * 1e6


def main():
    planners = {
        "Rust, `straight`": None,
        "Python, returns a constant": nothing,
        "Python, `straight` with NumPy": straight,
        "Python, looks at all neighbours": keep_right,
        "Python, asks for every array": everything,
    }
    neighbors = (1, 14, 64)
    print(f"Python {platform.python_version()}, NumPy {np.__version__}, shoal {shoal.__version__}, {platform.machine()}")
    print(f"{TICKS} ticks, medians of {ROUNDS} interleaved rounds; processor time, us for each robot and tick of `simulate`; (+) beside Rust")
    print()
    print(f"| {'planner':<34} | " + " | ".join(f"{n} neighbours" for n in neighbors) + " |")
    print("|---|" + "---|" * len(neighbors))
    scenarios = {n: shoal.Scenario(scene(n + 1)) for n in neighbors}
    taken = {name: {n: [] for n in neighbors} for name in planners}
    for _ in range(ROUNDS):
        for n, scenario in scenarios.items():
            for name, plan in planners.items():
                taken[name][n].append(per_robot_tick_us(scenario, plan))
    median = {name: {n: statistics.median(times) for n, times in row.items()} for name, row in taken.items()}
    rust = median["Rust, `straight`"]
    for name, row in median.items():
        cells = [f"{row[n]:.2f}" if name.startswith("Rust") else f"{row[n]:.2f} (+{row[n] - rust[n]:.2f})" for n in neighbors]
        print(f"| {name:<34} | " + " | ".join(cells) + " |")
    ring = shoal.Scenario("ring-15")
    own, theirs = [], []
    for _ in range(ROUNDS):
        own.append(per_robot_tick_us(ring, keep_right))
        theirs.append(per_robot_tick_us(ring, None))
    print()
    print(
        f"`simulate(\"ring-15\")`, us for each robot and tick: {statistics.median(theirs):.2f} with its own planner (`lanes`, Rust), "
        f"{statistics.median(own):.2f} with the planner in Python that looks at all neighbours"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
