"""What docs/python.md shows works, and the type stubs have what the module has."""

import ast
import inspect
import pathlib
import re

import shoal
from shoal import _native

ROOT = pathlib.Path(__file__).parents[2]


def test_the_page_shows_what_works(tmp_path, monkeypatch):
    page = (ROOT / "docs/python.md").read_text()
    blocks = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    assert len(blocks) == 2
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "my.py").write_text(blocks[0])
    names = {}
    exec(compile(blocks[1], "docs/python.md", "exec"), names)
    assert names["fleet"].metrics["arrived_all"]


def test_the_stubs_have_what_the_module_has():
    tree = ast.parse((pathlib.Path(shoal.__file__).parent / "_native.pyi").read_text())
    stubs = {node.name: node for node in tree.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    own = {name for name in vars(_native) if not name.startswith("_")}
    assert own == set(stubs)
    for name in own:
        if not inspect.isclass(getattr(_native, name)):
            continue
        members = {node.name for node in stubs[name].body if isinstance(node, ast.FunctionDef)}
        there = {member for member in vars(getattr(_native, name)) if not member.startswith("_")}
        assert {member for member in members if not member.startswith("_")} == there, name
        if getattr(shoal, name, None) is getattr(_native, name):
            undocumented = [
                node.name
                for node in stubs[name].body
                if isinstance(node, ast.FunctionDef) and not node.name.startswith("_") and not ast.get_docstring(node)
            ]
            assert not undocumented or name == "Plan", (name, undocumented)
    for name in shoal.__all__:
        assert name == "__version__" or inspect.getdoc(getattr(shoal, name)), name
