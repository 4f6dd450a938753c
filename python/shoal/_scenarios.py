"""Scenarios from files, the catalog, TOML texts and dicts."""

from __future__ import annotations

import os
from typing import Any, Dict, List, Mapping, Optional, Sequence, Union

from . import _errors, _native

Source = Union[str, "os.PathLike[str]", Mapping[str, Any], "Scenario"]
Set = Union[None, Mapping[str, Any], Sequence[str]]

# As on the command line: no scenario is larger.
_BYTES_MAX = 1 << 20


class Scenario:
    """A scenario that has been checked, with all overrides applied.

    Args:
        source: the path of a file (with a ``/``, an ending ``.toml``, or of a file that exists), else a name of the
            catalog; or a dict with the keys of a scenario file.
        name: what to call a scenario from a dict.
        mode: clock mode: ``"single"``, ``"lockstep"`` or ``"realtime"``.
        planner: planner of every robot.
        filter: ``"none"`` or ``"shared-gap"``.
        robots: number of robots, for scenarios with a layout.
        seed: random seed.
        duration_s: longest simulated time, s.
        set: any other keys, as a dict ``{"clock.tick_hz": 100}`` or as a list ``["clock.tick_hz=100"]``.

    Raises:
        ScenarioError: with all problems of the scenario.
    """

    def __init__(
        self,
        source: Source,
        *,
        name: Optional[str] = None,
        mode: Optional[str] = None,
        planner: Optional[str] = None,
        filter: Optional[str] = None,
        robots: Optional[int] = None,
        seed: Optional[int] = None,
        duration_s: Optional[float] = None,
        set: Set = None,
    ) -> None:
        # Whether its text is from code, and has no file.
        self._from_text = source._from_text if isinstance(source, Scenario) else isinstance(source, Mapping)
        # Where the files are that it names, such as its map.
        is_path = isinstance(source, os.PathLike) or isinstance(source, str) and os.path.isfile(source)
        self._folder = os.path.dirname(os.fspath(source)) if is_path else getattr(source, "_folder", "")
        if isinstance(source, Scenario):
            self._called, self._text, self._lined, before = source._called, source._text, source._lined, source._overrides
        else:
            self._called, self._text, self._lined = _read(source, name)
            before = {}
        own = dict(
            mode=mode, planner=planner, filter=filter, robots=robots, seed=seed, duration_s=duration_s
        )
        overrides = {**before, **{key: value for key, value in own.items() if value is not None}}
        overrides["set"] = [*before.get("set", []), *_assignments(set)]
        self._overrides = overrides
        given = {key: overrides.get(key) for key in own}
        self._native = _native.Scenario(self._called, self._text, self._lined, self._folder, set=overrides["set"], **given)

    @classmethod
    def from_toml(cls, text: str, *, name: str = "scenario", **overrides: Any) -> "Scenario":
        """A scenario from a TOML text. ``overrides`` are those of the constructor."""
        scenario = cls.__new__(cls)
        scenario._called, scenario._text, scenario._lined, scenario._overrides = name, text, True, {}
        scenario._from_text, scenario._folder = True, ""
        scenario.__init__(scenario, **overrides)  # type: ignore[misc]
        return scenario

    @property
    def toml(self) -> str:
        """The text of the scenario, without the overrides."""
        return self._text

    @property
    def name(self) -> str:
        """Its name."""
        return self._native.name

    @property
    def description(self) -> str:
        """What it shows, one line."""
        return self._native.description

    @property
    def mode(self) -> str:
        """Clock mode."""
        return self._native.mode

    @property
    def tick_hz(self) -> float:
        """Ticks per second."""
        return self._native.tick_hz

    @property
    def dt_s(self) -> float:
        """Length of a tick, s."""
        return 1.0 / self._native.tick_hz

    @property
    def duration_s(self) -> float:
        """Longest simulated time, s."""
        return self._native.duration_s

    @property
    def seed(self) -> int:
        """Random seed."""
        return self._native.seed

    @property
    def robots(self) -> List[str]:
        """Names of the robots, by index."""
        return self._native.robots

    @property
    def warnings(self) -> List[Dict[str, Any]]:
        """What is questionable: dicts with ``line``, ``key``, ``message`` and ``hint``."""
        return self._native.warnings

    def __repr__(self) -> str:
        return f"<shoal.Scenario {self.name}: {len(self.robots)} robots at {self.tick_hz:g} Hz, seed {self.seed}>"


def catalog() -> List[str]:
    """Names of the scenarios that are built in."""
    return [name for name, _ in _native.catalog()]


def validate(source: Source, **overrides: Any) -> List[Dict[str, Any]]:
    """Checks a scenario without running it, as ``shoal validate`` does.

    Args:
        source: as of :class:`Scenario`.
        overrides: as of :class:`Scenario`.

    Returns:
        What is questionable: a dict for each warning, with ``line``, ``key``, ``message`` and ``hint``.

    Raises:
        ScenarioError: with all problems of the scenario.
    """
    return Scenario(source, **overrides).warnings


def _read(source: Source, name: Optional[str]) -> tuple:
    if isinstance(source, Mapping):
        return name or "scenario", to_toml(source), False
    path = os.fspath(source)
    is_file = not isinstance(source, str) or "/" in path or path.endswith(".toml") or os.path.isfile(path)
    if not is_file:
        return path, _native.find_catalog(path), True
    try:
        with open(path, "rb") as file:
            content = file.read(_BYTES_MAX + 1)
    except FileNotFoundError:
        raise _errors.ScenarioError(
            f"scenario `{path}`: file not found\nhint: `shoal validate` lists the catalog, and so does shoal.catalog()"
        ) from None
    except OSError as error:
        raise _errors.ScenarioError(f"scenario `{path}`: cannot be read: {error.strerror}") from None
    if len(content) > _BYTES_MAX:
        raise _errors.ScenarioError(f"scenario `{path}`: it is larger than 1 MiB\nhint: is it a scenario?")
    try:
        return path, content.decode("utf-8"), True
    except UnicodeDecodeError as error:
        raise _errors.ScenarioError(
            f"scenario `{path}`: byte {error.start} is not UTF-8\nhint: a scenario is a TOML text"
        ) from None


def _assignments(given: Set) -> List[str]:
    if given is None:
        return []
    if isinstance(given, Mapping):
        return [f"{key}={_value(value)}" for key, value in given.items()]
    if isinstance(given, str):
        raise _errors.UsageError(f"set: `{given}` is not a dict or a list\nhint: write set={{\"clock.tick_hz\": 100}}")
    return list(given)


def to_toml(table: Mapping[str, Any]) -> str:
    """A dict as a TOML text: a line for each key."""
    return "".join(f"{_key(key)} = {_value(value)}\n" for key, value in table.items())


def _key(key: Any) -> str:
    text = str(key)
    plain = text and all(c.isascii() and (c.isalnum() or c in "-_") for c in text)
    return text if plain else _text(text)


def _value(value: Any) -> str:
    if hasattr(value, "tolist"):  # Numbers and arrays of NumPy.
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value) if value == value and abs(value) != float("inf") else ("nan" if value != value else f"{value}")
    if isinstance(value, (str, os.PathLike)):
        return _text(os.fspath(value))
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_key(key)} = {_value(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_value(inner) for inner in value) + "]"
    raise _errors.UsageError(
        f"scenario: a value of type {type(value).__name__} has no form in TOML: {value!r}\n"
        "hint: use numbers, strings, booleans, lists and dicts; leave a key out for its default"
    )


def _text(text: str) -> str:
    escaped = "".join(
        {"\\": "\\\\", '"': '\\"'}.get(c, c if c >= " " and c != "\x7f" else f"\\u{ord(c):04x}") for c in text
    )
    return f'"{escaped}"'
