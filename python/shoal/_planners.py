"""From what a user gives as a planner to the function that plans for one robot."""

from __future__ import annotations

import inspect
import sys
from typing import Any, Callable, Mapping, Optional, Union

from . import _errors, _native

Planner = Union[Callable[..., Any], type, object]


def check(planner: Any, what: str = "plan") -> None:
    """Refuses what cannot plan."""
    if inspect.isclass(planner):
        if not callable(getattr(planner, "plan", None)) and "__call__" not in vars(planner):
            raise _errors.UsageError(
                f"{what}: class `{planner.__name__}` has no method `plan`\nhint: write `def plan(self, view): ...` in it"
            )
    elif not callable(getattr(planner, "plan", None)) and not callable(planner):
        raise _errors.UsageError(
            f"{what}: {planner!r} cannot plan\nhint: give a function `plan(view)`, or a class with a method `plan(self, view)`"
        )


def made(planner: Any, robot: "_native.Robot") -> Callable[["_native.View"], Any]:
    """The function that plans for this robot. A class is constructed, with the robot if it takes an argument."""
    if inspect.isclass(planner):
        planner = planner(robot) if _takes_argument(planner) else planner()
    plan = getattr(planner, "plan", None)
    return plan if callable(plan) else planner


def _takes_argument(cls: type) -> bool:
    try:
        parameters = inspect.signature(cls).parameters.values()
    except (TypeError, ValueError):
        return False
    by_place = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.VAR_POSITIONAL)
    return any(parameter.kind in by_place for parameter in parameters)


def maker(plan: Union[None, Planner, Mapping[str, Planner]], robots: Optional[list] = None) -> Optional[Callable]:
    """What the native module calls with each robot: it returns the function that plans, or ``None`` for the planner that
    the scenario names."""
    if plan is None:
        return None
    if isinstance(plan, Mapping):
        unknown = [name for name in plan if robots is not None and name not in robots]
        if unknown:
            known = ", ".join(robots[:8]) + (", ..." if len(robots) > 8 else "")
            raise _errors.UsageError(f"plan: unknown robot `{unknown[0]}`\nhint: robots of this scenario: {known}")
        for name, planner in plan.items():
            check(planner, f"plan of robot `{name}`")
        return lambda robot: made(plan[robot.name], robot) if robot.name in plan else None
    check(plan)
    return lambda robot: made(plan, robot)


def run(plan: Planner) -> None:
    check(plan)
    function = plan.plan if inspect.isclass(plan) and hasattr(plan, "plan") else getattr(plan, "plan", plan)
    _native.run_agent(sys.argv[1:], maker(plan), _errors.words_of(function))
