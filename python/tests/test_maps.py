"""Scenarios with a map, from files and from code: the same walls for all, checked against the cells of the picture."""

import json
import pathlib
import shutil
import subprocess

import numpy as np
import pytest

import shoal

MAPS = pathlib.Path(__file__).parents[2] / "examples/maps"
# To the goal, and away from the nearest wall of the map, or from the nearest that is seen.
AGENT = """
import numpy as np, shoal

class Planner:
    def __init__(self, robot):
        self.map = robot.map

    def plan(self, view):
        walls = self.map if len(self.map) else view.obstacles
        ahead = view.goal - view.position
        velocity = 0.5 * ahead / max(np.hypot(*ahead), 1.0)
        if len(walls):
            along = walls.b - walls.a
            share = ((view.position - walls.a) * along).sum(axis=1) / (along**2).sum(axis=1)
            away = view.position - walls.a - np.clip(share, 0.0, 1.0)[:, None] * along
            nearest = away[np.argmin((away**2).sum(axis=1))]
            velocity = velocity + 0.02 * nearest / max(nearest @ nearest, 0.01)
        return velocity

if __name__ == "__main__":
    shoal.run(Planner)
"""


def edges(a, b, origin, cell_m):
    """The sides of cells that segments lie on: each as its middle, in half cells from the origin."""
    sides = []
    for from_, to in zip(np.rint((a - origin) / cell_m).astype(int), np.rint((b - origin) / cell_m).astype(int)):
        step, count = np.sign(to - from_), np.abs(to - from_).max()
        assert np.count_nonzero(step) == 1, "walls of cells are parallel to an axis"
        sides += [tuple(2 * from_ + (2 * i + 1) * step) for i in range(count)]
    return sides


def office_edges():
    """The same from the picture: the sides that a free cell shares with one that is not, or with the edge of the picture."""
    words = [line.split("#")[0] for line in (MAPS / "office.pgm").read_text().splitlines()]
    kind, width, height, white, *shades = " ".join(words).split()
    assert kind == "P2"
    free = (1.0 - np.array(shades, float).reshape(int(height), int(width)) / int(white)) < 0.196
    free = np.pad(free[::-1], 1)
    rows, columns = np.nonzero(free)
    sides = set()
    for row, column in zip(rows, columns):
        for up, right in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            if not free[row + up, column + right]:
                sides.add((2 * (column - 1) + 1 + right, 2 * (row - 1) + 1 + up))
    return sides


def views_of(scenario, **overrides):
    """What every robot sees in the first tick."""
    views = []

    def plan(view):
        views.append(view)
        return 0.0, 0.0

    shoal.simulate(scenario, plan, duration_s=0.05, **overrides)
    return views


def distances(position, walls):
    along = walls.b - walls.a
    share = ((position - walls.a) * along).sum(axis=1) / (along**2).sum(axis=1)
    return np.hypot(*(position - walls.a - np.clip(share, 0.0, 1.0)[:, None] * along).T)


def rows_of(walls, which=slice(None)):
    return {tuple(row) for row in np.column_stack([walls.id, walls.a, walls.b, walls.radius_m])[which]}


def test_walls_are_where_the_picture_has_them():
    views = views_of(MAPS / "office.toml")
    assert len(views) == 8
    for view in views:
        known = view.map
        assert known.a.shape == known.b.shape == (len(known), 2) and known.id.dtype == np.uint32
        found = edges(known.a, known.b, np.array([-6.0, -4.0]), 0.1)
        assert len(found) == len(set(found)) and set(found) == office_edges()
        assert len(set(known.id)) == len(known) and not known.velocity.any() and not known.radius_m.any()


@pytest.mark.parametrize("knows_map", [True, False])
def test_sensors_see_the_walls_within_range_with_or_without_the_map(knows_map):
    all_walls = views_of(MAPS / "office.toml")[0].map
    for view in views_of(MAPS / "office.toml", set={"defaults.knows_map": knows_map, "defaults.sensor_range_m": 1.5}):
        near = distances(view.position, all_walls) <= 1.5
        assert 0 < near.sum() < len(all_walls)
        # Before the first message, robots are seen as discs.
        assert rows_of(view.obstacles, view.obstacles.radius_m == 0.0) == rows_of(all_walls, near)
        assert len(view.map) == (len(all_walls) if knows_map else 0)


def test_a_map_with_more_walls_than_planners_of_shoal_look_at_is_whole(tmp_path):
    corners = np.array([[0.0, 0.0], [0.4, 0.0], [0.0, 0.4], [0.0, 0.0]])
    triangles = [(corners + [i % 30, i // 30]).tolist() for i in range(600)]
    (tmp_path / "many.geojson").write_text(json.dumps({"type": "MultiPolygon", "coordinates": [[t] for t in triangles]}))
    scenario = {
        "world": {"map": str(tmp_path / "many.geojson"), "x_m": [-9, 30], "y_m": [-9, 30]},
        "defaults": {"knows_map": True, "radius_m": 0.1, "filter": "none"},
        "robot": [{"id": "a", "start_m": [-2, -2], "goal_m": [-2, 20]}],
        "obstacle": [{"shape": "disc", "center_m": [-5, 0], "radius_m": 0.5}],
    }
    made = []

    class Looks:
        def __init__(self, robot):
            made.append(robot.map)

        def plan(self, view):
            made.append(view.map)
            return 0.0, 0.0

    shoal.simulate(scenario, Looks, duration_s=0.05)
    sides = {(*from_, *to) for t in triangles for from_, to in zip(t, t[1:])}
    for known in made:
        assert len(known) == 1 + 3 * 600
        assert np.array_equal(known.a[0], [-5.0, 0.0]) and known.radius_m[0] == 0.5
        assert {tuple(row) for row in np.column_stack([known.a, known.b])[1:]} == sides


def test_one_hash_for_a_map_from_everywhere(tmp_path, monkeypatch, script):
    for name in ("office.toml", "office.yaml", "office.pgm"):
        shutil.copy(MAPS / name, tmp_path / name)
    path = script("agent.py", AGENT)
    names = {"__name__": "agent"}
    exec(compile(AGENT, path, "exec"), names)
    file = shoal.Scenario(tmp_path / "office.toml", duration_s=4)
    simulated = shoal.simulate(file, names["Planner"])
    moved = np.hypot(*(simulated.trajectories.position[-1] - simulated.trajectories.position[0]).T)
    assert np.all(moved > 0.5)
    # Beside the file, wherever the script runs; from a place in code, relative to where it runs.
    monkeypatch.chdir(tmp_path.parent)
    assert shoal.launch(file, agent=path, mode="lockstep").trajectory_hash == simulated.trajectory_hash
    beside = shoal.simulate(f"{tmp_path.name}/office.toml", names["Planner"], duration_s=4)
    assert beside.trajectory_hash == simulated.trajectory_hash
    monkeypatch.chdir(tmp_path)
    in_code = {
        "world": {"map": "office.yaml"},
        "clock": {"tick_hz": 20.0},
        "defaults": {"planner": "lanes", "radius_m": 0.18, "speed_mps_max": 0.8, "knows_map": True},
        "robot": [
            {"id": name, "start_m": start, "goal_m": goal}
            for name, start, goal in zip(
                file.robots, simulated.trajectories.position[0].tolist(), simulated.trajectories.goal[0].tolist()
            )
        ],
    }
    text = shoal.Scenario.from_toml(file.toml)
    elsewhere = shoal.Scenario(in_code, set={"world.map": str(MAPS / "office.yaml")})
    for scenario in (in_code, text, elsewhere):
        assert shoal.simulate(scenario, names["Planner"], duration_s=4).trajectory_hash == simulated.trajectory_hash
        fleet = shoal.launch(scenario, agent=path, mode="lockstep", duration_s=4)
        assert fleet.trajectory_hash == simulated.trajectory_hash and fleet.verdict == "valid", fleet.log
    # Walls matter to this planner, and one that only senses them does something else.
    senses = shoal.simulate(file, names["Planner"], set={"defaults.knows_map": False, "defaults.sensor_range_m": 0.1})
    assert senses.trajectory_hash != simulated.trajectory_hash


def test_a_record_of_a_map_is_read_without_its_files(tmp_path):
    for name in ("office.toml", "office.yaml", "office.pgm"):
        shutil.copy(MAPS / name, tmp_path / name)
    path = tmp_path / "office.mcap"
    fleet = shoal.launch(tmp_path / "office.toml", mode="lockstep", record=path, duration_s=4)
    simulated = shoal.simulate(tmp_path / "office.toml", duration_s=4)
    for name in ("office.toml", "office.yaml", "office.pgm"):
        (tmp_path / name).unlink()
    record = shoal.load(path)
    assert record.trajectory_hash == simulated.trajectory_hash == fleet.trajectory_hash
    assert np.array_equal(record.trajectories.position, simulated.trajectories.position)
    assert record.metrics["obstacle_contacts"] == simulated.metrics["obstacle_contacts"]


def test_a_sweep_over_a_map_is_that_of_the_command_line(tmp_path):
    own = shoal.sweep(MAPS / "office.toml", seeds=1, out=tmp_path / "sweep", set={"clock.duration_s": 4})
    assert own.runs[0]["trajectory_hash"] == shoal.simulate(MAPS / "office.toml", duration_s=4).trajectory_hash


def test_maps_that_cannot_be_read_have_the_words_of_the_command_line(tmp_path):
    (tmp_path / "folder.yaml").mkdir()
    (tmp_path / "wrong.yaml").write_text("image: no.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n")
    with open(tmp_path / "large.geojson", "wb") as file:
        file.truncate(9 << 20)
    for name in ("none.yaml", "folder.yaml", "wrong.yaml", "large.geojson"):
        path = tmp_path / "scenario.toml"
        path.write_text(f'[world]\nmap = "{name}"\n[[robot]]\nid = "a"\nstart_m = [0, 0]\ngoal_m = [2, 0]\n')
        told = subprocess.run([shoal.executable(), "validate", str(path)], capture_output=True, text=True, check=False)
        assert told.returncode == 2 and "map" in told.stderr, told
        with pytest.raises(shoal.ScenarioError) as error:
            shoal.validate(path)
        assert str(error.value).splitlines() == [line.removeprefix("error: ") for line in told.stderr.splitlines()]
