import os
import pathlib
import subprocess
import sys
import time

import pytest

import shoal

HERE = pathlib.Path(__file__).parent
sys.path.insert(0, str(HERE))


@pytest.fixture(autouse=True)
def nothing_is_left():
    """No test leaves a fleet in shared memory."""
    yield
    deadline = time.monotonic() + 5.0
    # Another fleet of this machine may just begin or end.
    while (left := _left()) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not left, f"left behind: {left}"


def _left():
    return [root for root in pathlib.Path("/dev/shm").glob(f"shoal-{os.getuid()}-*") if _is_mine(root)]


def _is_mine(root):
    """Other fleets may run on this machine: those are left alone that have a living process."""
    return not subprocess.run(["pgrep", "-f", str(root)], stdout=subprocess.DEVNULL, check=False).returncode == 0


@pytest.fixture
def script(tmp_path):
    """Writes a script, and returns its path."""

    def write(name, text):
        path = tmp_path / name
        path.write_text(text)
        return str(path)

    return write


LANES = {
    "world": {"x_m": [-6, 6], "y_m": [-6, 6]},
    "clock": {"mode": "lockstep", "duration_s": 20, "tick_hz": 20},
    "defaults": {"planner": "straight", "filter": "none"},
    "robot": [
        {"id": name, "start_m": [-3, 2 * row], "goal_m": [3, 2 * row]} for row, name in enumerate(["a", "b", "c"])
    ],
}


@pytest.fixture
def lanes():
    """Three robots side by side that do not meet."""
    return shoal.Scenario(LANES)
