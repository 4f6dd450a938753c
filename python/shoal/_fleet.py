"""What the executable `shoal` of the same wheel does: fleets of processes, and sweeps."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import subprocess
import sys
import sysconfig
from typing import Any, Dict, Iterable, List, Mapping, Optional, Sequence, Union

from . import _errors
from ._scenarios import Scenario, Set, Source, _assignments

Path = Union[str, "os.PathLike[str]"]
_USAGE = 2


def executable() -> str:
    """The path of the executable ``shoal`` that was installed with this module.

    The environment variable ``SHOAL`` names another one. Processes of one fleet must come from the same commit.

    Raises:
        FleetError: if there is none.
    """
    named = os.environ.get("SHOAL")
    candidates = [named] if named else [os.path.join(sysconfig.get_path("scripts"), "shoal"), shutil.which("shoal")]
    for path in candidates:
        if path and os.access(path, os.X_OK) and os.path.isfile(path):
            return path
    raise _errors.FleetError(
        "the executable `shoal` is not beside this Python, nor in PATH\nhint: install the wheel that holds both, or set SHOAL"
    )


class Run:
    """What a fleet of processes came to.

    Attributes:
        report: the report, ``shoal.report/1``, as a dict.
        exit_code: that of ``shoal run``: 0 all expectations met, 1 an expectation failed, 3 something went wrong around
            the run.
        log: what the fleet printed while it ran: events, and the lines of the agents with the names of their robots.
    """

    report: Dict[str, Any]
    exit_code: int
    log: str

    def __init__(self, report: Dict[str, Any], exit_code: int, log: str) -> None:
        self.report, self.exit_code, self.log = report, exit_code, log

    @property
    def trajectory_hash(self) -> str:
        """16 hexadecimal digits; in ``lockstep`` those of :func:`shoal.simulate` with the same planner."""
        return self.report["trajectory_hash"]

    @property
    def metrics(self) -> Dict[str, Any]:
        """The outcome in the report."""
        return self.report["outcome"]

    @property
    def verdict(self) -> str:
        """``valid``, or what is wrong with the run: ``starved``, ``impaired``, ... (docs/report.md)."""
        return self.report["verdict"]

    def __repr__(self) -> str:
        return f"<shoal.Run {self.report['scenario']} ({self.report['mode']}): {self.verdict}, hash {self.trajectory_hash}>"


def launch(
    scenario: Source,
    *,
    agent: Union[None, str, Sequence[str]] = None,
    mode: Optional[str] = None,
    record: Optional[Path] = None,
    **overrides: Any,
) -> Run:
    """Runs a fleet of processes, one per robot, with ``shoal run``.

    Args:
        scenario: as of :class:`Scenario`.
        agent: agent of every robot: a script (``"my.py"``, run by this Python), a command (``"python3 my.py"``), or the
            words of one. By default what the scenario says.
        mode: ``"lockstep"``, ``"realtime"`` or ``"single"``; by default what the scenario says.
        record: file for a record of the run, which :func:`shoal.load` reads.
        overrides: as of :class:`Scenario`: ``seed``, ``set``, ``robots``, ``duration_s``, ``planner``, ``filter``.

    Returns:
        A :class:`Run`.

    Raises:
        ScenarioError: with all problems of the scenario.
        FleetError: if there is no report: with the words of the command line.
    """
    checked = Scenario(scenario, mode=mode, **overrides)
    words = [executable(), "run", *_options(checked), "--format", "json"]
    if agent is not None:
        words += ["--agent", shlex.join(_command(agent))]
    if record is not None:
        words += ["--record", os.fspath(record)]
    done = subprocess.run(words, input=_named(checked), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
    try:
        report = json.loads(done.stdout)
    except ValueError:
        raise _failed(done) from None
    return Run(report, done.returncode, done.stderr)


def _command(agent: Union[str, Sequence[str]]) -> List[str]:
    if not isinstance(agent, str):
        return [os.fspath(word) for word in agent]
    if agent.endswith(".py") and os.path.isfile(agent):
        return [sys.executable, agent]
    return shlex.split(agent)


def _options(scenario: Scenario) -> List[str]:
    """The scenario as its name or `-`, and the overrides, as options of the command line."""
    words = ["-" if not scenario._lined or scenario._from_text else scenario._called]
    names = {"mode": "--mode", "planner": "--planner", "filter": "--filter", "robots": "--robots", "seed": "--seed"}
    for key, option in names.items():
        if scenario._overrides.get(key) is not None:
            words += [option, str(scenario._overrides[key])]
    if scenario._overrides.get("duration_s") is not None:
        words += ["--duration", f"{float(scenario._overrides['duration_s'])!r}s"]
    for assignment in scenario._overrides.get("set", []):
        words += ["--set", assignment]
    return words


def _named(scenario: Scenario) -> str:
    """The text for standard input: with the name of the scenario, if that is not in it."""
    if scenario._lined and not scenario._from_text:
        return ""
    text = scenario.toml
    is_named = any(line.split("=")[0].strip() == "name" for line in text.splitlines() if not line.startswith("["))
    return text if is_named else f"name = {json.dumps(scenario.name)}\n{text}"


def _failed(done: "subprocess.CompletedProcess[str]") -> _errors.ShoalError:
    lines = [line for line in done.stderr.splitlines() if line.strip()]
    told = [line for line in lines if line.startswith(("error: ", "hint: "))] or lines[-3:]
    text = "\n".join(line[len("error: ") :] if line.startswith("error: ") else line for line in told)
    text = text or f"`shoal` ended with code {done.returncode}"
    return _errors.UsageError(text) if done.returncode == _USAGE else _errors.FleetError(text)


class Sweep:
    """The results of a sweep.

    Attributes:
        runs: a dict for each run, in the order of the plan: scenario, planner, seed, ``success``, metrics
            (docs/sweep.md); varied keys are columns of their own. ``pandas.DataFrame(sweep.runs)`` and
            ``polars.DataFrame(sweep.runs, infer_schema_length=None)`` make tables of them.
        robots: a dict for each robot of each run.
        summary: what all runs say, as in ``summary.json``; ``None`` while the sweep has not ended.
        plan: what was to be run, as in ``sweep.json``.
        database: path of ``sweep.db`` (SQLite), or ``None`` while the sweep has not ended.
    """

    runs: List[Dict[str, Any]]
    robots: List[Dict[str, Any]]
    summary: Optional[Dict[str, Any]]
    plan: Dict[str, Any]
    database: Optional[str]

    def __init__(self, folder: str) -> None:
        self.plan = _json(os.path.join(folder, "sweep.json"), folder)
        summary = os.path.join(folder, "summary.json")
        self.summary = _json(summary, folder) if os.path.exists(summary) else None
        database = os.path.join(folder, "sweep.db")
        self.database = database if os.path.exists(database) else None
        runs = sorted(_lines(os.path.join(folder, "runs.jsonl")), key=lambda run: run["run"])
        self.runs, self.robots = [], []
        for run in runs:
            robots, varied = run.pop("per_robot"), run.pop("varied")
            for key in ("schema", "cost"):
                run.pop(key, None)
            first = {key: run.pop(key) for key in ("run", "scenario", "planner", "seed")}
            self.runs.append({**first, **varied, **run})
            self.robots += [{**first, **varied, "robot": robot.pop("id"), **_other(robot)} for robot in robots]

    def columns(self) -> Dict[str, list]:
        """The runs as a dict of columns."""
        names: Dict[str, None] = {}
        for run in self.runs:
            names.update(dict.fromkeys(run))
        return {name: [run.get(name) for run in self.runs] for name in names}

    def __len__(self) -> int:
        return len(self.runs)

    def __repr__(self) -> str:
        ended = sum(1 for run in self.runs if run["success"])
        return f"<shoal.Sweep: {len(self.runs)} runs, {ended} successful>"


def _other(robot: Dict[str, Any]) -> Dict[str, Any]:
    """Columns of a robot that a run has as well: the robot's are named so."""
    return {("robot_planner" if key == "planner" else key): value for key, value in robot.items()}


def _json(path: str, folder: str) -> Dict[str, Any]:
    try:
        with open(path, encoding="utf-8") as file:
            return json.load(file)
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else str(error)
        raise _errors.RecordError(
            f"directory `{folder}`: it is not that of a sweep: `{os.path.basename(path)}`: {why}\n"
            "hint: `shoal sweep SCENARIO --out DIR` and shoal.sweep(..., out=DIR) write one"
        ) from None


def _lines(path: str) -> Iterable[Dict[str, Any]]:
    with open(path, encoding="utf-8") as file:
        for line in file:
            # The last line of a sweep that was killed may be cut off.
            if line.endswith("\n"):
                yield json.loads(line)


def load_sweep(folder: Path) -> Sweep:
    """Reads the directory of a sweep, also of one that has not ended.

    Args:
        folder: what ``shoal sweep --out`` was given.

    Returns:
        A :class:`Sweep`.

    Raises:
        RecordError: if it is not the directory of a sweep.
    """
    return Sweep(os.fspath(folder))


def sweep(
    scenarios: Union[str, Path, Iterable[Path]],
    *,
    out: Path,
    planners: Iterable[str] = (),
    seeds: Union[int, Iterable[int]] = 5,
    vary: Optional[Mapping[str, Iterable[Any]]] = None,
    filters: Iterable[str] = (),
    set: Set = None,
    baseline: Optional[str] = None,
    mode: str = "single",
    jobs: Optional[int] = None,
) -> Sweep:
    """Runs scenarios x planners x varied keys x seeds on all processors, as ``shoal sweep`` does; resumes what is in ``out``.

    Args:
        scenarios: a file or a name of the catalog, or several.
        out: directory for the results: new, empty, or that of the same sweep.
        planners: planners of shoal; by default the scenario's own.
        seeds: a number of seeds (from 0 on), or the seeds.
        vary: values of keys, as in ``{"radio.drop": [0, 0.1]}``.
        filters: ``"none"``, ``"shared-gap"``.
        set: keys of all runs, as of :class:`Scenario`.
        baseline: compare the makespans with those of this planner.
        mode: ``"single"`` or ``"lockstep"``.
        jobs: runs at a time; by default the number of processors.

    Returns:
        A :class:`Sweep`, the same as ``load_sweep(out)``.

    Raises:
        UsageError, FleetError: with the words of the command line.
    """
    from ._scenarios import _value

    named = [scenarios] if isinstance(scenarios, (str, os.PathLike)) else list(scenarios)
    words = [executable(), "sweep", *[os.fspath(name) for name in named], "--out", os.fspath(out), "--mode", mode]
    words += ["--seeds", f"0..{seeds}" if isinstance(seeds, int) else ",".join(str(seed) for seed in seeds)]
    for planner in planners:
        words += ["--planner", planner]
    for key, values in (vary or {}).items():
        words += ["--vary", f"{key}={','.join(_value(value) for value in values)}"]
    filters = list(filters)
    if filters:
        words += ["--filter", ",".join(filters)]
    for assignment in _assignments(set):
        words += ["--set", assignment]
    if baseline is not None:
        words += ["--baseline", baseline]
    if jobs is not None:
        words += ["--jobs", str(jobs)]
    done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True, check=False)
    if done.returncode != 0:
        raise _failed(done)
    return load_sweep(out)
