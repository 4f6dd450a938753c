"""One planner in this process and in processes: one trajectory hash."""

import numpy as np
import pytest
from conftest import HERE
from planner import plan
from wanderer import Wanderer

import shoal


def test_simulate_is_what_fifteen_processes_do():
    simulated = shoal.simulate("ring-15", plan, seed=3)
    assert len(simulated.scenario.robots) == 15
    fleet = shoal.launch("ring-15", agent=str(HERE / "planner.py"), mode="lockstep", seed=3)
    assert fleet.trajectory_hash == simulated.trajectory_hash
    assert fleet.verdict == "valid", fleet.log
    again = shoal.simulate("ring-15", plan, seed=3)
    assert again.trajectory_hash == simulated.trajectory_hash
    assert again.metrics == simulated.metrics == fleet.metrics


def test_state_and_random_numbers_are_each_robots_own(lanes):
    simulated = shoal.simulate(lanes, Wanderer, seed=5)
    fleet = shoal.launch(lanes, agent=str(HERE / "wanderer.py"), seed=5)
    assert fleet.trajectory_hash == simulated.trajectory_hash
    assert simulated.metrics["arrived_all"]
    assert shoal.simulate(lanes, Wanderer, seed=6).trajectory_hash != simulated.trajectory_hash


def test_planners_of_shoal_have_the_hash_of_the_command_line():
    simulated = shoal.simulate("demo-15", seed=2, duration_s=10)
    fleet = shoal.launch("demo-15", mode="single", seed=2, duration_s=10)
    assert simulated.trajectory_hash == fleet.trajectory_hash


def test_some_robots_have_planners_of_their_own(lanes):
    seen = []

    def stand(view):
        seen.append(view.name)
        return 0.0, 0.0

    result = shoal.simulate(lanes, {"b": stand}, duration_s=2)
    assert set(seen) == {"b"}
    moved = np.ptp(result.trajectories.position[:, :, 0], axis=0)
    assert moved[1] == 0.0 and moved[0] > 1.0 and moved[2] > 1.0
    with pytest.raises(shoal.UsageError, match="unknown robot `d`"):
        shoal.simulate(lanes, {"d": stand})


def test_the_same_script_in_real_time(lanes):
    fleet = shoal.launch(lanes, agent=str(HERE / "planner.py"), mode="realtime", duration_s=12)
    assert fleet.metrics["arrived_all"], fleet.log
    assert fleet.metrics["robot_contacts"] == 0


def test_an_agent_of_a_scenario_is_a_list_and_has_arguments(lanes, script):
    text = """
import sys, shoal
speed = float(sys.argv[1])
shoal.run(lambda view: (min(speed, (view.goal - view.position)[0] / view.dt_s), 0.0))
"""
    path = script("slow.py", text)
    robots = [dict(robot) for robot in shoal_robots(lanes)]
    robots[1]["agent"] = ["python3", path, "0.25"]
    import conftest

    fleet = shoal.launch({**conftest.LANES, "robot": robots}, duration_s=4)
    of_b = [robot for robot in fleet.report["per_robot"] if robot["id"] == "b"][0]
    assert of_b["path_length_m"] == pytest.approx(1.0, abs=0.05)


def shoal_robots(_scenario):
    import conftest

    return conftest.LANES["robot"]
