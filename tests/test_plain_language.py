"""Names and headings avoid retired words; `retired_words.tsv` gives the standard term of each."""

from __future__ import annotations

import ast
import csv
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parent.parent
#: Folders whose modules, classes and functions are checked; of tests only modules are.
PACKAGES = ("mstmm", "derive", "runtime", "benchmarks")


def standard_terms() -> dict[str, str]:
    """Retired word -> standard term."""
    with Path(__file__).with_name("retired_words.tsv").open(encoding="utf-8") as file:
        return {
            row["retired"]: row["standard term"] for row in csv.DictReader(file, delimiter="\t")
        }


def words_of(name: str) -> list[str]:
    """Lower-case words of an identifier or a heading."""
    return [word.lower() for word in re.findall(r"[A-Z]?[a-z]+", name)]


def names_in(path: Path, with_definitions: bool) -> Iterator[str]:
    """The module's name and, `with_definitions`, those of its classes and functions."""
    yield path.stem
    if with_definitions:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
                yield node.name


def headings_in(path: Path) -> Iterator[str]:
    """Headings of a page, without those lines of code blocks that look like one."""
    is_code = False
    for line in path.read_text(encoding="utf-8").splitlines():
        is_code ^= line.startswith("```")
        if not is_code and re.match(r"#{1,6} ", line):
            yield re.sub(r"`[^`]*`", "", line)


def test_identifiers_use_standard_terms() -> None:
    terms, found = standard_terms(), list[str]()
    for folder in (*PACKAGES, "tests"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            for name in names_in(path, folder != "tests"):
                found += [
                    f"{path.relative_to(ROOT)}: {name}: {word} -> {terms[word]}"
                    for word in words_of(name)
                    if word in terms
                ]
    assert found == []


def test_headings_use_standard_terms() -> None:
    terms, found = standard_terms(), list[str]()
    pages = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "examples").rglob("*.md")]
    for path in sorted(pages):
        for heading in headings_in(path):
            found += [
                f"{path.relative_to(ROOT)}: {heading}: {word} -> {terms[word]}"
                for word in words_of(heading)
                if word in terms
            ]
    assert found == []


def test_a_retired_word_is_found() -> None:
    """The check itself sees words within names of both styles and within headings."""
    assert "trail" in words_of("_closing_trail") and "bridge" in words_of("SceneBridge")
    assert all(term and word == word.lower() for word, term in standard_terms().items())
