"""Regenerate the committed C, and compare it with a fresh derivation."""

from __future__ import annotations

import difflib
from pathlib import Path

from ..codegen.template_rendering import generated_files, write_generated
from .element_specs import all_facts, all_specs, on_demand_specs


def regenerate(folder: Path | str) -> list[Path]:
    """Derive everything and write it; remove files of elements that no longer exist."""
    target, specs = Path(folder), all_specs()
    written = write_generated(specs, target, hinges=all_facts(specs), on_demand=on_demand_specs())
    for path in target.iterdir():
        if path.suffix in (".c", ".h", ".json") and path not in written:
            path.unlink()
    return written


def differences(folder: Path | str) -> list[str]:
    """Unified diffs between a fresh derivation and `folder`; empty if identical."""
    target = Path(folder)
    specs = all_specs()
    fresh = generated_files(specs, hinges=all_facts(specs), on_demand=on_demand_specs())
    stored = {
        path.name: path.read_text(encoding="utf-8")
        for path in sorted(target.iterdir())
        if path.suffix in (".c", ".h", ".json")
    }
    diffs = []
    for name in sorted(fresh.keys() | stored.keys()):
        if fresh.get(name) != stored.get(name):
            lines = difflib.unified_diff(
                stored.get(name, "").splitlines(),
                fresh.get(name, "").splitlines(),
                f"committed/{name}",
                f"derived/{name}",
                lineterm="",
            )
            diffs.append("\n".join(list(lines)[:40]))
    return diffs
