"""What a planner sees: shapes, types, and that values stay."""

import numpy as np

import shoal


def test_shapes_and_types(lanes):
    views = []

    def plan(view):
        views.append(view)
        return 1.0, 0.0

    result = shoal.simulate(lanes, plan, duration_s=1, set={"defaults.radio_range_m": 9})
    assert len(views) == 3 * 20
    view = views[-1]
    assert (view.name, view.index, view.tick, view.kind) == ("c", 2, 19, "point")
    assert view.time_s == 19 * view.dt_s and view.dt_s == 0.05
    for array in (view.position, view.velocity, view.goal):
        assert array.shape == (2,) and array.dtype == np.float64
    others = view.neighbors
    assert len(others) == 2 and list(others.id) == [0, 1] and others.id.dtype == np.uint32
    for array in (others.position, others.velocity, others.next):
        assert array.shape == (2, 2) and array.dtype == np.float64
    for array in (others.yaw_rad, others.radius_m, others.age_s, others.remaining_m):
        assert array.shape == (2,)
    assert others.arrived.dtype == others.stopped.dtype == bool
    assert np.allclose(others.age_s, view.dt_s)
    # A neighbour's message is one tick old, and says where the neighbour is now.
    at = result.trajectories.position[18]
    assert np.array_equal(others.position, at[:2]) and np.allclose(others.next, result.trajectories.position[19][:2])
    # The view of an earlier tick keeps its values, and arrays are the caller's own.
    first = views[2]
    assert first.tick == 0 and np.array_equal(first.position, [-3.0, 4.0])
    first.position[0] = 9.0
    assert first.position[0] == -3.0
    assert view.limits.speed_mps_max > 0 and view.joints_rad is None and view.goal_yaw_rad is None
    assert view.allowed.shape == (0, 3) and len(view.map) == 0


def test_obstacles_and_the_map():
    views = []

    def plan(view):
        views.append(view)
        return 0.0, 0.0

    scenario = {
        "world": {"x_m": [-6, 6], "y_m": [-6, 6]},
        "robot": [{"id": "a", "start_m": [0, 0], "goal_m": [3, 0], "knows_map": True, "sensor_range_m": 3.0}],
        "obstacle": [
            {"shape": "disc", "center_m": [2.0, 0.0], "radius_m": 0.5},
            {"shape": "polygon", "corners_m": [[4, 4], [5, 4], [5, 5]]},
        ],
    }
    shoal.simulate(scenario, plan, duration_s=0.1)
    seen, known = views[0].obstacles, views[0].map
    assert len(seen) == 1 and np.array_equal(seen.a, [[2.0, 0.0]]) and np.array_equal(seen.a, seen.b)
    assert np.array_equal(seen.radius_m, [0.5]) and np.array_equal(seen.velocity, [[0.0, 0.0]])
    assert len(known) == 4 and list(known.id) == [0, 1, 1, 1]


def test_the_filter_says_what_it_allows(lanes):
    rows = []

    def plan(view):
        rows.append(view.allowed)
        return 0.0, 0.0

    close = {"robot[1].start_m": [-3, 0.5], "defaults.filter": "shared-gap", "defaults.radio_range_m": 9}
    shoal.simulate(lanes, plan, duration_s=1, set=close)
    some = np.concatenate(rows)
    assert some.shape[1] == 3 and len(some) > 0
    assert np.allclose(np.hypot(some[:, 0], some[:, 1]), 1.0)
    # Standing still is always allowed.
    assert np.all(some[:, 2] >= -1e-9)


def test_bodies_that_drive(lanes):
    robots = [
        {"id": "u", "kind": "unicycle", "start_m": [-2, 0], "goal_m": [2, 0]},
        {"id": "d", "kind": "diff-drive", "start_m": [-2, 3], "goal_m": [2, 3]},
    ]
    scenario = {"world": {"x_m": [-6, 6], "y_m": [-6, 6]}, "robot": robots, "defaults": {"filter": "none"}}
    kinds = set()

    def plan(view):
        kinds.add(view.kind)
        if view.kind == "diff-drive":
            return shoal.Plan((4.0, 4.0), wheels=True)
        return 0.5, 0.0

    result = shoal.simulate(scenario, plan, duration_s=1)
    assert kinds == {"unicycle", "diff-drive"}
    assert np.all(result.trajectories.position[-1, :, 0] > -2.0)
    assert np.array_equal(result.trajectories.command[0], [[0.5, 0.0], [4.0, 4.0]])
