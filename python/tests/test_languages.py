"""Robots with planners of shoal, in Python and in C++ in one fleet: one hash, in whatever order they run."""

import pathlib

import pytest

import shoal

ROOT = pathlib.Path(__file__).parents[2]


def test_rust_python_and_cpp_drive_in_one_fleet(monkeypatch):
    monkeypatch.chdir(ROOT)
    if not (ROOT / "target/cpp-agent").exists():
        pytest.skip("`make -C examples/cpp-agent` has not been run")
    fleets = [shoal.launch("examples/cpp-agent/three.toml") for _ in range(3)]
    assert {fleet.verdict for fleet in fleets} == {"valid"}, fleets[0].log
    assert len({fleet.trajectory_hash for fleet in fleets}) == 1
    assert fleets[0].metrics["arrived_all"] and fleets[0].metrics["robot_contacts"] == 0, fleets[0].metrics


def test_a_plan_that_fails_in_cpp_is_told(monkeypatch):
    monkeypatch.chdir(ROOT)
    if not (ROOT / "target/cpp-agent").exists():
        pytest.skip("`make -C examples/cpp-agent` has not been run")
    fleet = shoal.launch(
        {
            "world": {"x_m": [-6, 6], "y_m": [-6, 6]},
            "clock": {"mode": "lockstep", "duration_s": 8},
            "defaults": {"planner": "straight", "filter": "none"},
            "robot": [
                {"id": "a", "start_m": [-2, 0], "goal_m": [2, 0]},
                {"id": "b", "start_m": [-2, 2], "goal_m": [2, 2], "kind": "unicycle", "agent": "target/cpp-agent"},
            ],
        }
    )
    robots = {robot["id"]: robot for robot in fleet.report["per_robot"]}
    assert robots["a"]["arrived"] and robots["b"]["gone"] == "dead"
    assert "robot `b`: this planner is for points" in fleet.log, fleet.log
