"""The page on the command line names every command and option there is, and no other."""

from __future__ import annotations

import re

from tests.support.commands import Command
from tests.support.paths import ROOT

PAGE = (ROOT / "docs" / "reference" / "command-line.md").read_text(encoding="utf-8")
COMMON = {"--help", "--json"}


def options(text: str) -> set[str]:
    return set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", text))


def test_every_command_has_its_section(mstmm: Command) -> None:
    commands = set(re.findall(r"^│ ([a-z]+) ", mstmm("--help").out.split("Commands")[1], re.M))
    assert commands == set(re.findall(r"^## `mstmm ([a-z]+)", PAGE, re.M))


def test_every_option_is_described(mstmm: Command) -> None:
    for part in PAGE.split("\n## `mstmm ")[1:]:
        command = part.split(" ", 1)[0].rstrip("`")
        there = options(mstmm(command, "--help").out) - COMMON
        missing = there - options(part)
        assert not missing - ({"--hinge"} if command == "check" else set()), command
        assert options(part) - COMMON <= there, command
