"""Records, sweeps and scenarios as Python has them."""

import sqlite3
import subprocess

import duckdb
import numpy as np
import pandas
import polars
import pytest
from conftest import HERE
from planner import plan

import shoal


def test_a_record_is_what_was_simulated(tmp_path):
    path = tmp_path / "ring.mcap"
    fleet = shoal.launch("ring-15", agent=str(HERE / "planner.py"), mode="lockstep", record=path, duration_s=6)
    simulated = shoal.simulate("ring-15", plan, duration_s=6)
    record = shoal.load(path)
    assert record.trajectory_hash == simulated.trajectory_hash == fleet.trajectory_hash
    assert record.cut is None and record.left_out == 0 and record.mode == "lockstep"
    of_record, own = record.trajectories, simulated.trajectories
    assert of_record.robots == own.robots
    for name in ("tick", "time_s", "position", "yaw_rad", "goal", "command", "arrived", "active"):
        assert np.array_equal(getattr(of_record, name), getattr(own, name), equal_nan=name not in ("arrived", "active")), name
    assert own.position.shape == (len(own), 15, 2) and np.isfinite(own.command[:-1]).all()
    assert np.isnan(own.command[-1]).all()
    assert record.metrics["arrived"] == simulated.metrics["arrived"]
    kept = [(event["tick"], event["robot"], event["event"]) for event in record.events]
    assert kept == [(event["tick"], event["robot"], event["event"]) for event in simulated.events]


def test_robots_that_come_late_are_nowhere_before():
    result = shoal.simulate("late-join", duration_s=5)
    late = np.isnan(result.trajectories.position[0]).any(axis=1)
    assert late.any() and not late.all()
    assert not result.trajectories.active[0][late].any()


def test_what_is_no_record_is_refused(tmp_path):
    path = tmp_path / "no.mcap"
    with pytest.raises(shoal.RecordError, match="No such file"):
        shoal.load(path)
    path.write_bytes(b"hello")
    with pytest.raises(shoal.RecordError, match="it is not a record\nhint: "):
        shoal.load(path)


def test_a_record_that_is_cut_off_has_what_is_there(tmp_path):
    path = tmp_path / "ring.mcap"
    shoal.launch("head-on", mode="lockstep", record=path)
    whole = shoal.load(path)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) - 64])
    cut = shoal.load(path)
    assert "cut off" in cut.cut and cut.trajectory_hash is None or len(cut.trajectories) == len(whole.trajectories)


def test_a_sweep_is_the_same_from_python_and_from_the_command_line(tmp_path):
    own = shoal.sweep(["head-on", "ring-15"], planners=["apf", "orca"], seeds=2, out=tmp_path / "python", set={"clock.duration_s": 15})
    words = ["sweep", "head-on", "ring-15", "--planner", "apf", "--planner", "orca", "--seeds", "0..2"]
    words += ["--set", "clock.duration_s=15", "--out", str(tmp_path / "line")]
    subprocess.run([shoal.executable(), *words], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    line = shoal.load_sweep(tmp_path / "line")
    assert own.runs == line.runs and own.robots == line.robots and own.summary == line.summary
    assert len(own) == 8 and len(own.robots) == 2 * 2 * (2 + 15)
    table = pandas.DataFrame(own.runs)
    assert list(table.columns[:4]) == ["run", "scenario", "planner", "seed"] and len(table) == 8
    assert pandas.DataFrame(own.columns()).equals(table)
    with sqlite3.connect(own.database) as database:
        rows = database.execute("select count(*), sum(success) from run").fetchone()
    assert rows == (8, int(table["success"].sum()))
    simulated = shoal.simulate("ring-15", planner="orca", seed=1, set={"clock.duration_s": 15})
    swept = table[(table.scenario == "ring-15") & (table.planner == "orca") & (table.seed == 1)].iloc[0]
    assert swept["trajectory_hash"] == simulated.trajectory_hash
    with pytest.raises(shoal.UsageError, match="unknown planner `apff`"):
        shoal.sweep("head-on", planners=["apff"], out=tmp_path / "wrong")
    with pytest.raises(shoal.RecordError, match="it is not that of a sweep"):
        shoal.load_sweep(tmp_path)


def test_other_programs_read_a_sweep_whose_first_runs_lack_values(tmp_path):
    vary = {"clock.duration_s": [0.2, 15]}
    sweep = shoal.sweep("head-on", planners=["orca"], seeds=101, vary=vary, out=tmp_path / "sweep")
    missing = [run["makespan_s"] is None for run in sweep.runs]
    assert len(missing) == 202 and all(missing[:101]) and not any(missing[101:])
    query = "select count(*), count(makespan_s), sum(makespan_s) from {}"
    frame_of_pandas = pandas.DataFrame(sweep.runs)
    expected = (202, 101, pytest.approx(frame_of_pandas["makespan_s"].sum()))
    frame = polars.DataFrame(sweep.runs, infer_schema_length=None)
    assert frame.columns == list(frame_of_pandas.columns)
    # DuckDB finds the frame by the name of the variable.
    assert duckdb.sql(query.format("frame_of_pandas")).fetchall() == [expected]
    with sqlite3.connect(sweep.database) as database:
        assert database.execute(query.format("run")).fetchone() == expected
    assert (len(frame), frame["makespan_s"].count(), frame["makespan_s"].sum()) == expected


def test_rows_of_own_planners_are_a_table_too():
    rows = [shoal.simulate("head-on", plan, seed=seed, trajectories=False).row(planner="mine") for seed in range(2)]
    table = pandas.DataFrame(rows)
    assert list(table["planner"]) == ["mine", "mine"] and table["makespan_s"].notna().all()


def test_scenarios_from_everywhere(tmp_path):
    text = 'name = "two"\n[[robot]]\nid = "a"\nstart_m = [0, 0]\ngoal_m = [2, 0]\n'
    path = tmp_path / "two.toml"
    path.write_text(text)
    table = {"name": "two", "robot": [{"id": "a", "start_m": (0, 0), "goal_m": np.array([2.0, 0.0])}]}
    scenarios = [shoal.Scenario(path), shoal.Scenario(str(path)), shoal.Scenario.from_toml(text), shoal.Scenario(table)]
    hashes = {shoal.simulate(scenario).trajectory_hash for scenario in scenarios}
    assert len(hashes) == 1
    for scenario in scenarios:
        assert (scenario.name, scenario.robots, scenario.dt_s) == ("two", ["a"], 1 / scenario.tick_hz)
        assert shoal.launch(scenario, mode="lockstep").trajectory_hash in hashes
    changed = shoal.Scenario(scenarios[0], seed=4, set={"clock.tick_hz": 40})
    assert (changed.seed, changed.tick_hz, scenarios[0].seed) == (4, 40.0, shoal.Scenario(path).seed)
    assert "ring-15" in shoal.catalog() and shoal.validate("ring-15") == []


def test_problems_have_the_words_of_the_command_line(tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_text('[[robot]]\nid = "a"\nstart_m = [0, 0]\ngoal_m = [2, 0]\nplanner = "apff"\nradius = 1\n')
    told = subprocess.run([shoal.executable(), "validate", str(path)], capture_output=True, text=True, check=False).stderr
    with pytest.raises(shoal.ScenarioError) as error:
        shoal.validate(path)
    assert str(error.value).splitlines() == [line.removeprefix("error: ") for line in told.splitlines()]
    assert [problem["line"] for problem in error.value.problems] == [5, 6]
    with pytest.raises(shoal.ScenarioError) as error:
        shoal.Scenario({"robot": [{"id": "a", "start_m": [0, 0], "goal_m": [2, 0], "planner": "apff"}]})
    assert "robot[0].planner" in str(error.value) and "line" not in str(error.value).splitlines()[0]
    with pytest.raises(shoal.ScenarioError, match="unknown scenario `ring-16`"):
        shoal.Scenario("ring-16")
    with pytest.raises(shoal.ScenarioError, match="no/such.toml`: file not found"):
        shoal.simulate("no/such.toml")
    with pytest.raises(shoal.ScenarioError, match="clock.tick_hzz"):
        shoal.simulate("ring-15", set={"clock.tick_hzz": 3})
    with pytest.raises(shoal.UsageError, match="has no form in TOML"):
        shoal.Scenario({"name": None})
