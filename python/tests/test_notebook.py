"""The cells of the notebook run, in their order, in one namespace: what a kernel does, without one."""

import json
import linecache
import pathlib

ROOT = pathlib.Path(__file__).parents[2]


def test_the_notebook_runs(monkeypatch, capsys):
    monkeypatch.setenv("MPLBACKEND", "Agg")
    monkeypatch.chdir(ROOT)
    notebook = json.loads((ROOT / "examples/notebook/planners.ipynb").read_text())
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    documented = [cell for cell in notebook["cells"] if cell["cell_type"] == "markdown"]
    assert len(cells) == 3 and len(documented) == 4
    names = {"__name__": "__main__"}
    for number, cell in enumerate(cells):
        source, name = "".join(cell["source"]), f"<cell {number}>"
        # As IPython does, so that `inspect` finds the source.
        linecache.cache[name] = (len(source), None, source.splitlines(keepends=True), name)
        exec(compile(source, name, "exec"), names)
    assert "in 15 processes:" in capsys.readouterr().out
    assert len(names["runs"]) == 9 and "ratio_to_orca" in names["table"]
