"""What goes wrong in a planner: the robot and the line are named, and the fleet goes on."""

import functools

import numpy as np
import pytest

import shoal

HEAD = "import numpy as np\nimport shoal\n\n\ndef plan(view):\n"
TAIL = '\n\n\nif __name__ == "__main__":\n    shoal.run(plan)\n'
# Robot b fails when it has gone for half a second; the others go on.
WRONG = {
    "an exception": ("    return 1.0 / (view.tick // 10 - 1), 0.0", "raised ZeroDivisionError: ", 7),
    "not a number": ("    return (np.nan if view.tick > 9 else 1.0), 0.0", "returned (nan, 0): a command must be finite", 6),
    "a wrong shape": ("    return np.ones(3 if view.tick > 9 else 2)", "returned an array of shape (3,), not two numbers", 6),
    "nothing": ("    return (1.0, 0.0) if view.tick < 10 else None", "returned None (is a `return` missing?)", 6),
    "a text": ('    return (1.0, 0.0) if view.tick < 10 else "left"', "returned an object of type str", 6),
}


def body(lines):
    return HEAD + '    if view.name != "b":\n        return 1.0 - view.arrived, 0.0\n' + lines + TAIL


@pytest.mark.parametrize("what", WRONG)
def test_the_fleet_goes_on_and_the_error_names_robot_and_line(what, lanes, script):
    line, words, _ = WRONG[what]
    text = body(line)
    path = script("wrong.py", text)
    fleet = shoal.launch(lanes, agent=path, duration_s=8)
    robots = {robot["id"]: robot for robot in fleet.report["per_robot"]}
    assert robots["a"]["arrived"] and robots["c"]["arrived"], fleet.log
    assert not robots["b"]["arrived"] and robots["b"]["gone"] == "dead"
    told = [line for line in fleet.log.splitlines() if "b died" in line]
    # Where the exception was raised, else where the function begins.
    where = 8 if what == "an exception" else 5
    assert len(told) == 1 and "robot `b`: plan at tick 10 (0.50 s)" in told[0], fleet.log
    assert words in told[0] and f"wrong.py:{where}, in plan" in told[0], told[0]
    # The same in this process, as an exception.
    names = {}
    exec(compile(text, path, "exec"), names)
    with pytest.raises(shoal.PlanError) as error:
        shoal.simulate(lanes, names["plan"])
    assert words in str(error.value) and (error.value.robot, error.value.tick) == ("b", 10)
    assert (error.value.file, error.value.line) == (path, where)


def test_a_robot_that_fails_is_restarted_if_its_scenario_says_so(lanes, script):
    text = body("    if view.tick == 10:\n        raise RuntimeError('once')\n    return 1.0 - view.arrived, 0.0")
    fleet = shoal.launch(
        lanes, agent=script("once.py", text), set={"defaults.restart": "on-failure", "defaults.restart_delay_s": 0.5}
    )
    assert fleet.metrics["arrived_all"], fleet.log
    assert "restarted" in fleet.log and "raised RuntimeError: once" in fleet.log


def test_a_slow_plan_is_named_and_costs_the_others_nothing(lanes, script):
    text = body("    import time\n    time.sleep(0.08)\n    return 1.0, 0.0")
    fleet = shoal.launch(lanes, agent=script("slow.py", text), mode="realtime", duration_s=8)
    robots = {robot["id"]: robot for robot in fleet.report["per_robot"]}
    assert robots["a"]["arrived"] and robots["c"]["arrived"], fleet.log
    assert "robot `b`: a plan took 8" in fleet.log and "longer than a period of 50.0 ms" in fleet.log, fleet.log
    assert "slow.py:5, in plan" in fleet.log, fleet.log


def test_a_plan_that_hangs_is_named_with_the_line_where_it_is(lanes, script):
    text = body("    while view.tick >= 10:\n        pass\n    return 1.0, 0.0")
    fleet = shoal.launch(
        lanes, agent=script("hangs.py", text), set={"fleet.straggler": "drop", "fleet.straggler_limit_s": 2.0}
    )
    robots = {robot["id"]: robot for robot in fleet.report["per_robot"]}
    assert robots["a"]["arrived"] and robots["c"]["arrived"], fleet.log
    assert "robot `b`: a plan has been running for" in fleet.log and "hangs.py:" in fleet.log, fleet.log
    assert "b dropped" in fleet.log, fleet.log


def test_what_cannot_begin_is_told_with_its_command(lanes, script):
    check = {
        "nothing.py": ("print('no planner here')", "ended with code 0 before it was ready"),
        "syntax.py": ("def plan(view)\n    pass\n", "SyntaxError"),
        "import.py": ("import no_such_module", "No module named 'no_such_module'"),
        "class.py": (
            "import shoal\nclass P:\n    def __init__(self, robot):\n        raise ValueError('no gain')\n"
            "    def plan(self, view): ...\nshoal.run(P)\n",
            "ValueError: no gain",
        ),
    }
    for name, (text, words) in check.items():
        path = script(name, text)
        fleet = shoal.launch(lanes, set=[f'robot[1].agent=["python3", "{path}"]'], duration_s=8)
        robots = {robot["id"]: robot for robot in fleet.report["per_robot"]}
        assert robots["a"]["arrived"] and fleet.verdict == "impaired", fleet.log
        told = [line for line in fleet.log.splitlines() if "b not-started" in line]
        assert len(told) == 1 and f"`python3 {path}`" in told[0] and words in told[0], fleet.log
    path = script("waits.py", "import sys, time\nprint('loads a model', flush=True)\ntime.sleep(60)\n")
    fleet = shoal.launch(
        lanes, set=[f'robot[1].agent=["python3", "{path}"]', "fleet.start_limit_s=1"], duration_s=8
    )
    assert f"`python3 {path}` is not ready within 1 s: loads a model" in fleet.log, fleet.log
    with pytest.raises(shoal.FleetError, match="robot `a`: agent `no-such-python my.py`: `no-such-python` is not in PATH"):
        shoal.launch(lanes, agent="no-such-python my.py")


def test_what_is_no_planner_is_refused(lanes):
    for wrong in (3, "plan", object()):
        with pytest.raises(shoal.UsageError, match="cannot plan"):
            shoal.simulate(lanes, wrong)

    class Empty:
        pass

    with pytest.raises(shoal.UsageError, match="class `Empty` has no method `plan`"):
        shoal.simulate(lanes, Empty)
    with pytest.raises(shoal.UsageError, match="shoal run SCENARIO --agent"):
        shoal.run(lambda view: (0.0, 0.0))


def test_interrupts_are_no_errors_of_the_planner(lanes):
    def interrupted(view):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        shoal.simulate(lanes, interrupted)


def test_every_form_of_two_numbers_is_a_command(lanes):
    forms = [
        lambda view: (1, 0),
        lambda view: [1.0, 0.0],
        lambda view: np.array([1.0, 0.0]),
        lambda view: np.array([1, 0]),
        lambda view: (np.float32(1.0), np.float64(0.0)),
        lambda view: shoal.Plan((1.0, 0.0)),
        functools.partial(lambda view, speed: (speed, 0.0), speed=1.0),
    ]
    hashes = {shoal.simulate(lanes, form, duration_s=2).trajectory_hash for form in forms}
    assert len(hashes) == 1
    with pytest.raises(shoal.PlanError, match="rates of wheels, which a point does not have"):
        shoal.simulate(lanes, lambda view: shoal.Plan((1.0, 0.0), wheels=True))
    with pytest.raises(ValueError, match="state `maybe`"):
        shoal.Plan((0.0, 0.0), state="maybe")
