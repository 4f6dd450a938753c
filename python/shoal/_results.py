"""What comes out of a run."""

from __future__ import annotations

import json
import os
from typing import Any, Dict, List, Optional, Union

import numpy as np

from . import _native, _planners
from ._scenarios import Scenario, Source


class Trajectories:
    """Where everybody was at every tick: arrays with a row for each tick and a column for each robot.

    Attributes:
        robots: names of the robots, by column.
        tick: the ticks. Shape (T,), uint64.
        time_s: simulated time, s. Shape (T,).
        position: m; NaN while a robot is not in the world. Shape (T, N, 2).
        yaw_rad: heading, rad. Shape (T, N).
        goal: where the goal is, m. Shape (T, N, 2).
        command: the command of the tick: velocity, m/s, or forward speed, m/s, and turn rate, rad/s, or rates of joints or
            wheels, rad/s; NaN where there was none. Shape (T, N, 2).
        joints_rad: joint angles of arms, rad; zero for other bodies. Shape (T, N, 2).
        arrived: whether the robot was at its last goal. Shape (T, N), bool.
        active: whether its process took part. Shape (T, N), bool.
    """

    robots: List[str]
    tick: np.ndarray
    time_s: np.ndarray
    position: np.ndarray
    yaw_rad: np.ndarray
    goal: np.ndarray
    command: np.ndarray
    joints_rad: np.ndarray
    arrived: np.ndarray
    active: np.ndarray

    def __init__(self, robots: List[str], arrays: Dict[str, np.ndarray]) -> None:
        self.robots = robots
        self.__dict__.update(arrays)

    def __len__(self) -> int:
        return len(self.tick)

    def of(self, robot: str) -> np.ndarray:
        """The positions of one robot, m. Shape (T, 2)."""
        return self.position[:, self.robots.index(robot)]

    def __repr__(self) -> str:
        return f"<shoal.Trajectories: {len(self.tick)} ticks of {len(self.robots)} robots>"


class Result:
    """What a simulated run came to.

    Attributes:
        scenario: the scenario.
        trajectory_hash: 16 hexadecimal digits over every robot's state at every tick: the same from ``simulate``, and from
            ``shoal run`` in ``single`` and ``lockstep``.
        report: the report of the run, ``shoal.report/1``, as a dict.
        trajectories: :class:`Trajectories`, or ``None`` if they were not wanted.
        events: the log: dicts with ``tick``, ``time_s``, ``robot``, ``event`` and ``detail``.
        took_s: wall time of the run, s.
    """

    scenario: Scenario
    trajectory_hash: str
    report: Dict[str, Any]
    trajectories: Optional[Trajectories]
    events: List[Dict[str, Any]]
    took_s: float

    def __init__(self, scenario: Scenario, raw: Dict[str, Any]) -> None:
        self.scenario = scenario
        self.trajectory_hash = raw["trajectory_hash"]
        self.report = json.loads(raw["report"])
        arrays = raw.get("arrays")
        self.trajectories = Trajectories(raw["robots"], arrays) if arrays is not None else None
        self.events = raw["events"]
        self.took_s = raw["took_s"]

    @property
    def metrics(self) -> Dict[str, Any]:
        """The outcome in the report: ``arrived_all``, ``makespan_s``, ``robot_contacts``, ... (docs/report.md)."""
        return self.report["outcome"]

    @property
    def per_robot(self) -> List[Dict[str, Any]]:
        """How every robot did: a dict for each, as in the report."""
        return self.report["per_robot"]

    @property
    def success(self) -> bool:
        """All robots have arrived, and nothing touched."""
        outcome = self.metrics
        return bool(outcome["arrived_all"]) and outcome["robot_contacts"] + outcome["obstacle_contacts"] == 0

    def row(self, **columns: Any) -> Dict[str, Any]:
        """The run as a row of a table: ``columns``, then scenario, seed, success, hash and metrics that are plain values."""
        plain = {key: value for key, value in self.metrics.items() if value is None or isinstance(value, (bool, int, float, str))}
        own = {"scenario": self.scenario.name, "seed": self.scenario.seed, "success": self.success}
        return {**columns, **own, "trajectory_hash": self.trajectory_hash, **plain}

    def __repr__(self) -> str:
        outcome = self.metrics
        contacts = outcome["robot_contacts"] + outcome["obstacle_contacts"]
        return (
            f"<shoal.Result {self.scenario.name}: {outcome['arrived']} of {len(self.scenario.robots)} arrived, "
            f"{contacts} contacts, hash {self.trajectory_hash}>"
        )


def simulate(
    scenario: Source,
    plan: Any = None,
    *,
    trajectories: bool = True,
    **overrides: Any,
) -> Result:
    """Runs a fleet in this process, in one thread, as ``shoal run --mode single`` does.

    The trajectory hash is that of ``shoal run`` in ``single`` and ``lockstep``, also where processes run the same planner with
    :func:`shoal.run`.

    Args:
        scenario: as of :class:`Scenario`.
        plan: who plans: ``None`` for the planners that the scenario names; a function ``plan(view)`` for all robots; a class
            with a method ``plan(self, view)``, which is constructed for each robot; or a dict of these by the name of the
            robot, where the other robots keep the planners of the scenario.
        trajectories: whether to keep where everybody was: about 100 bytes for each robot and tick.
        overrides: as of :class:`Scenario`: ``seed``, ``set``, ``robots``, ``duration_s``, ``planner``, ``filter``.

    Returns:
        A :class:`Result`.

    Raises:
        ScenarioError: with all problems of the scenario.
        PlanError: if a planner raises an exception, or returns something that is not a plan: with the robot, the tick and
            the line.
    """
    # What a run in one thread is: in `realtime`, filters expect messages to be late.
    checked = Scenario(scenario, **{**overrides, "mode": "single"})
    make = _planners.maker(plan, checked.robots)
    return Result(checked, _native.simulate(checked._native, make, trajectories))


class Record:
    """A record of a run, as arrays.

    Attributes:
        trajectories: :class:`Trajectories`. Columns are slots; a robot that was added is in the slot that it took.
        events: the log: dicts with ``tick``, ``time_s``, ``robot``, ``event`` and ``detail``.
        name: name of the scenario.
        mode: clock mode.
        seed: random seed.
        tick_hz: ticks per second.
        trajectory_hash: as in the report, or ``None`` if the record is cut off.
        report: outcome and robots as in the report, without latencies, or ``None`` if the record is cut off or robots were
            added while the fleet ran.
        cut: why the record ends before its end, or ``None``.
        left_out: frames that are missing because the disk did not keep up.
    """

    trajectories: Trajectories
    events: List[Dict[str, Any]]
    name: str
    version: str
    build: str
    mode: str
    seed: int
    tick_hz: float
    trajectory_hash: Optional[str]
    report: Optional[Dict[str, Any]]
    cut: Optional[str]
    left_out: int

    def __init__(self, raw: Dict[str, Any]) -> None:
        self.trajectories = Trajectories(raw.pop("robots"), raw.pop("arrays"))
        report = raw.pop("report")
        self.report = None if report is None else json.loads(report)
        self.__dict__.update(raw)

    @property
    def metrics(self) -> Optional[Dict[str, Any]]:
        """The outcome in the report, or ``None`` if there is no report."""
        return None if self.report is None else self.report["outcome"]

    def __repr__(self) -> str:
        return f"<shoal.Record {self.name} ({self.mode}): {self.trajectories!r}>"


def load(path: Union[str, "os.PathLike[str]"]) -> Record:
    """Reads a record that ``shoal run --record FILE`` has written.

    Args:
        path: the file.

    Returns:
        A :class:`Record`. One that is cut off has what is there, and says so in ``cut``.

    Raises:
        RecordError: if the file is not a record.
    """
    return Record(_native.load(os.fspath(path)))
