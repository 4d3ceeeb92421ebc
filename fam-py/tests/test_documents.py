"""The Python code of the project's pages."""

import ast
import importlib
import inspect
import re
from pathlib import Path
from typing import Any, get_type_hints

import pytest

import flatten_anything as fa
import shapes

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", ROOT / "fam-py" / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def blocks() -> list[Any]:
    found = []
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for block in re.finditer(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
            line = text.count("\n", 0, block.start()) + 1
            found.append(pytest.param(block[1], id=f"{page.relative_to(ROOT)}:{line}"))
    return found


def test_there_are_blocks() -> None:
    assert len(blocks()) > 3


@pytest.mark.parametrize("code", blocks())
def test_a_block_runs_and_uses_what_there_is(code: str) -> None:
    tree = ast.parse(code)
    if "flatten_anything.ray" in code:
        pytest.importorskip("ray")
    names: dict[str, Any] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for one in node.names:
                module = importlib.import_module(one.name)
                top = importlib.import_module(one.name.split(".")[0])
                names[one.asname or top.__name__] = module if one.asname else top
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and (called := named(node.func, names)) is not None:
            known = parameters(called)
            for keyword in node.keywords:
                assert keyword.arg in known, f"{ast.unparse(node.func)} takes no {keyword.arg}"
        elif isinstance(node, ast.Attribute):
            named(node, names)
    # What needs a cluster is not run.
    if "flatten_anything.ray" not in code:
        vertices, faces = shapes.sheet()
        exec(compile(tree, "<page>", "exec"), {"vertices": vertices, "faces": faces})


def named(node: ast.expr, names: dict[str, Any]) -> Any:
    """Return what an expression such as `fa.unwrap` stands for, or None if it is another."""
    if isinstance(node, ast.Name):
        return names.get(node.id)
    if isinstance(node, ast.Attribute) and (owner := named(node.value, names)) is not None:
        assert hasattr(owner, node.attr), f"there is no {ast.unparse(node)}"
        return getattr(owner, node.attr)
    return None


def parameters(called: Any) -> set[str]:
    """Return the names of the arguments of a call, with those of `Options` where it takes them."""
    known = set(inspect.signature(called).parameters)
    return known | set(get_type_hints(fa.Options)) if "options" in known else known
