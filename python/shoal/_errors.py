"""The exceptions of shoal. Their words are those of the command line: the thing, the cause, the way out."""

from __future__ import annotations

import os
import sys
import traceback
from typing import Any, Callable, List, Optional


class ShoalError(Exception):
    """Base class of all exceptions of this module."""


class ScenarioError(ShoalError):
    """A scenario is wrong, or does not exist.

    Attributes:
        problems: a dict for each problem, with ``line``, ``key``, ``message`` and ``hint``; empty if the scenario
            could not be read at all.
    """

    problems: List[dict]

    def __init__(self, text: str, problems: Optional[List[dict]] = None) -> None:
        super().__init__(text)
        self.problems = problems or []


class PlanError(ShoalError):
    """A planner has raised an exception, or has returned something that is not a plan.

    Attributes:
        robot: name of the robot.
        tick: the tick that was planned.
        file: the script, or ``None`` if it is not known.
        line: the line in it: of the exception, else of the function that plans.
    """

    robot: str
    tick: int
    file: Optional[str]
    line: Optional[int]


class UsageError(ShoalError):
    """Something was asked for that cannot be."""


class FleetError(ShoalError):
    """A fleet could not be run, or this process could not take part in it."""


class RecordError(ShoalError):
    """A file is not a record, or cannot be read."""


# What the native module calls.


def scenario_error(text: str, problems: Optional[List[dict]]) -> ScenarioError:
    return ScenarioError(text, problems)


def record_error(text: str) -> RecordError:
    return RecordError(text)


def fleet_error(text: str) -> FleetError:
    return FleetError(text)


def usage_error(text: str) -> UsageError:
    script = os.path.basename(sys.argv[0]) or "my.py"
    return UsageError(
        f'{text}\nhint: `shoal run SCENARIO --agent "python3 {script}"` starts this script for each robot; '
        "shoal.simulate() runs a planner in this process"
    )


def plan_error(
    robot: str,
    tick: int,
    time_s: float,
    plan: Callable[..., Any],
    problem: Optional[str],
    cause: Optional[BaseException],
) -> BaseException:
    """The exception for a plan that failed: with the exception of the script, or with what is wrong with its answer."""
    if cause is not None and not isinstance(cause, Exception):
        return cause  # KeyboardInterrupt and SystemExit are not errors of the planner.
    file, line, name = place_of(plan)
    if cause is not None:
        file, line, name = _place_in(cause, file) or (file, line, name)
        said = traceback.format_exception_only(type(cause), cause)[-1].strip()
        problem = f"raised {said}"
    error = PlanError(f"robot `{robot}`: plan at tick {tick} ({time_s:.2f} s) {problem} ({_words(file, line, name)})")
    error.robot, error.tick, error.file, error.line = robot, tick, file, line
    error.__cause__ = cause
    return error


def place_of(plan: Callable[..., Any]) -> tuple:
    """File, line and name of the function that plans."""
    function = plan
    while hasattr(function, "func"):  # functools.partial
        function = function.func
    if not hasattr(function, "__code__") and not hasattr(function, "__func__"):
        function = getattr(type(function), "__call__", function)
    function = getattr(function, "__func__", function)
    function = getattr(function, "__wrapped__", function)
    code = getattr(function, "__code__", None)
    if code is None:
        return None, None, getattr(plan, "__name__", type(plan).__name__)
    return code.co_filename, code.co_firstlineno, function.__name__


def words_of(plan: Callable[..., Any]) -> str:
    """File, line and name of the function that plans, for messages."""
    return _words(*place_of(plan))


def place_of_thread(thread: int) -> Optional[str]:
    """Where a thread is, in the innermost frame that is the user's own."""
    frame = sys._current_frames().get(thread)
    frames = []
    while frame is not None:
        frames.append((frame.f_code.co_filename, frame.f_lineno, frame.f_code.co_name))
        frame = frame.f_back
    own = [place for place in frames if _is_own(place[0])]
    return _words(*(own or frames)[0]) if frames else None


def _place_in(cause: BaseException, file: Optional[str]) -> Optional[tuple]:
    """The innermost place of an exception in the file of the planner, else in a file of the user."""
    entries = [(e.filename, e.lineno, e.name) for e in traceback.extract_tb(cause.__traceback__)]
    if isinstance(cause, SyntaxError) and cause.filename:
        return cause.filename, cause.lineno, "<module>"
    for known in (lambda name: name == file, _is_own, lambda name: True):
        for place in reversed(entries):
            if known(place[0]):
                return place
    return None


def _is_own(file: str) -> bool:
    parts = file.replace(os.sep, "/")
    return "/site-packages/" not in parts and not parts.startswith(_STDLIB) and not file.startswith("<frozen")


_STDLIB = os.path.dirname(traceback.__file__).replace(os.sep, "/") + "/"


def _words(file: Optional[str], line: Optional[int], name: Optional[str]) -> str:
    if file is None:
        return f"in {name}"
    shown = file
    if isinstance(file, str) and os.path.isabs(file):
        shorter = os.path.relpath(file)
        shown = shorter if not shorter.startswith("..") else file
    return f"{shown}:{line}, in {name}"
