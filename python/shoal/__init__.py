"""shoal: fleets of robots, one process per robot, and planners in Python.

A planner is a function that gets what its robot sees in a tick (:class:`View`) and returns a command of two numbers: the
velocity ``(vx, vy)`` of a point, m/s, or the forward speed, m/s, and the turn rate, rad/s, of a unicycle or a diff-drive::

    import numpy as np
    import shoal

    def plan(view):
        ahead = view.goal - view.position
        distance = np.linalg.norm(ahead)
        return ahead / max(distance, 1e-9) * min(view.limits.speed_mps_max, distance / view.dt_s)

    result = shoal.simulate("ring-15", plan, seed=7)     # this process, one thread
    print(result.metrics["makespan_s"], result.trajectory_hash)

The same function in fifteen processes is a script that ends with ``shoal.run(plan)`` and is started by
``shoal run ring-15 --agent "python3 my.py"`` or by :func:`launch`. Lengths are metres, angles radians counter-clockwise from +x,
times seconds.
"""

from ._errors import FleetError, PlanError, RecordError, ScenarioError, ShoalError, UsageError
from ._fleet import Run, Sweep, executable, launch, load_sweep, sweep
from ._native import Limits, Neighbors, Obstacles, Plan, Robot, View, __version__
from ._planners import run as _run
from ._results import Record, Result, Trajectories, load, simulate
from ._scenarios import Scenario, catalog, validate

__all__ = [
    "FleetError",
    "Limits",
    "Neighbors",
    "Obstacles",
    "Plan",
    "PlanError",
    "Record",
    "RecordError",
    "Result",
    "Robot",
    "Run",
    "Scenario",
    "ScenarioError",
    "ShoalError",
    "Sweep",
    "Trajectories",
    "UsageError",
    "View",
    "catalog",
    "executable",
    "launch",
    "load",
    "load_sweep",
    "run",
    "simulate",
    "sweep",
    "validate",
    "__version__",
]


def run(plan) -> None:
    """Makes this process the agent of a robot, until the robot leaves or the run ends.

    ``shoal run SCENARIO --agent "python3 my.py"`` starts the script for each robot; so does ``agent = ["python3", "my.py"]`` in a
    scenario. While the process waits for its tick, other threads of it run.

    Args:
        plan: a function ``plan(view)``, or a class with a method ``plan(self, view)``, which is constructed once, with a
            :class:`Robot` if its constructor takes an argument. It returns two numbers (a tuple, a list, an array of shape
            (2,)) or a :class:`Plan`.

    Raises:
        PlanError: if the planner raises an exception, or returns something that is not a plan. If the script does not catch
            it, the process ends, and the robot is dead for the fleet, which goes on; with ``restart = "on-failure"`` in the
            scenario it gets another process.
        UsageError: if ``shoal run`` did not start this process.
        FleetError: if the process cannot take part in the fleet.
    """
    _run(plan)
