"""`shoal new --python`: a scenario and a planner that drive at once, and say what is missing where they cannot."""

import importlib.util
import json
import os
import subprocess
import sys

import pytest

import shoal


@pytest.fixture
def made(tmp_path, monkeypatch):
    """The directory that `shoal new --python` made, as the current one."""
    told = subprocess.run(
        [shoal.executable(), "new", "--python", "mine"], cwd=tmp_path, capture_output=True, text=True, check=True
    ).stdout
    assert "\n  cd mine\n  shoal run fleet.toml" in told, told
    monkeypatch.chdir(tmp_path / "mine")
    return tmp_path / "mine"


def run(mode, path):
    words = [shoal.executable(), "run", "fleet.toml", "--mode", mode, "--format", "json"]
    environment = {**os.environ, "PATH": path, "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run(words, env=environment, capture_output=True, text=True, check=False, timeout=120)


def test_it_drives_in_processes_and_in_a_notebook(made):
    # `python3` is the one of the environment that the wheel is installed in, as when it is active.
    path = os.pathsep.join([os.path.dirname(sys.executable), os.environ["PATH"]])
    done = run("lockstep", path)
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    outcome = report["outcome"]
    assert report["verdict"] == "valid" and outcome["arrived_all"], done.stderr
    assert outcome["robot_contacts"] == outcome["obstacle_contacts"] == 0, outcome
    spec = importlib.util.spec_from_file_location("planner", made / "planner.py")
    planner = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(planner)
    simulated = shoal.simulate("fleet.toml", planner.plan)
    assert simulated.trajectory_hash == report["trajectory_hash"] and simulated.success
    # The script is what drives: another function, another way.
    assert shoal.simulate("fleet.toml").trajectory_hash != report["trajectory_hash"]
    realtime = run("realtime", path)
    assert json.loads(realtime.stdout)["outcome"]["arrived_all"], realtime.stderr


def test_without_the_module_each_agent_says_what_to_do(made, tmp_path):
    # A Python that has no packages at all.
    bare = tmp_path / "bin" / "python3"
    bare.parent.mkdir()
    bare.write_text(f'#!/bin/sh\nexec "{sys.executable}" -I -S "$@"\n')
    bare.chmod(0o755)
    done = run("lockstep", os.pathsep.join([str(bare.parent), os.environ["PATH"]]))
    assert done.returncode != 0
    told = [line for line in done.stderr.splitlines() if "west not-started" in line]
    assert told, done.stderr
    for words in ("`python3 planner.py`", "has no module `", "hint: install the wheel `shoal-fleet`", sys.executable):
        assert words in told[0], done.stderr
