"""Attributes and arguments that docstrings list exist."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parent.parent
PACKAGES = ("mstmm", "derive", "runtime")
Definition = ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


def listed_names(docstring: str, heading: str) -> list[str]:
    """Names of the entries `name: text` and `one, other: text` in a section of a docstring."""
    section = re.search(rf"^{heading}:\n((?: {{4}}.*\n?|\n)+)", docstring, re.MULTILINE)
    entries = re.findall(r"^ {4}(\w+(?:, \w+)*):", section[1], re.MULTILINE) if section else []
    return [name for entry in entries for name in entry.split(", ")]


def own_attributes(definition: ast.ClassDef) -> set[str]:
    """Attributes that a class declares, assigns to `self`, or defines as methods."""
    names = set()
    for node in ast.walk(definition):
        if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            names.add(node.attr)
    for statement in definition.body:
        targets: list[ast.expr] = []
        if isinstance(statement, ast.AnnAssign):
            targets = [statement.target]
        targets += statement.targets if isinstance(statement, ast.Assign) else []
        names |= {target.id for target in targets if isinstance(target, ast.Name)}
        if isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef):
            names.add(statement.name)
    return names


@cache
def definitions() -> tuple[tuple[Path, Definition], ...]:
    """Classes and functions of the product, each with its file."""
    paths = [path for folder in PACKAGES for path in sorted((ROOT / folder).rglob("*.py"))]
    trees = ((path, ast.parse(path.read_text(encoding="utf-8"))) for path in paths)
    return tuple(
        (path, node)
        for path, tree in trees
        for node in ast.walk(tree)
        if isinstance(node, Definition)
    )


@cache
def attributes_by_class() -> dict[str, set[str]]:
    """Attributes of the classes of each name, with those of their base classes."""
    classes = [node for _, node in definitions() if isinstance(node, ast.ClassDef)]
    own: dict[str, set[str]] = {}
    bases: dict[str, set[str]] = {}
    for node in classes:
        own.setdefault(node.name, set()).update(own_attributes(node))
        bases.setdefault(node.name, set()).update(
            re.findall(r"\w+", " ".join(map(ast.unparse, node.bases)))
        )

    def with_bases(name: str) -> set[str]:
        return own[name].union(*(with_bases(base) for base in bases[name] - {name} if base in own))

    return {name: with_bases(name) for name in own}


def stale_names() -> Iterator[str]:
    for path, node in definitions():
        docstring = ast.get_docstring(node) or ""
        if isinstance(node, ast.ClassDef):
            known = attributes_by_class()[node.name]
            names = listed_names(docstring, "Attributes")
        else:
            known = {
                argument.arg for argument in ast.walk(node.args) if isinstance(argument, ast.arg)
            }
            names = listed_names(docstring, "Args")
        for name in names:
            if name not in known:
                yield f"{path.relative_to(ROOT)}:{node.lineno}: {node.name}: {name}"


def test_listed_names_exist() -> None:
    assert list(stale_names()) == []


def test_a_stale_name_is_found() -> None:
    text = (
        "Records.\n\nAttributes:\n    place: offset.\n    q, u: states\n        and more: text.\n"
    )
    assert listed_names(text, "Attributes") == ["place", "q", "u"]
    (definition,) = ast.parse("class A:\n    x: int\n    def __init__(self, b): self.c = b").body
    assert isinstance(definition, ast.ClassDef)
    assert own_attributes(definition) == {"x", "c", "__init__"}
