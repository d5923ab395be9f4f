"""The scenes that mutants start from: all of examples/ and of the pages, and one of many tables."""

from __future__ import annotations

import re
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

from mstmm import load_scene

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).parent
Data = dict[str, Any]


@cache
def seeds() -> dict[str, Data]:
    """Name -> tables of a scene that compiles, paths of files made absolute."""
    found = {
        path.parent.name: self_contained_scene(tomllib.loads(path.read_text("utf-8")), path.parent)
        for path in sorted(ROOT.glob("examples/*/scene.toml"))
    }
    pages = [*ROOT.glob("docs/howto/*.md"), *ROOT.glob("docs/reference/*.md")]
    for page in [ROOT / "README.md", *sorted(pages, key=lambda path: path.name)]:
        blocks = re.findall(r"^```toml\n(.*?)^```", page.read_text("utf-8"), re.M | re.S)
        for i, block in enumerate(blocks):
            found[f"{page.stem}-{i}"] = tomllib.loads(block)
    for path in sorted((HERE / "scenes").glob("*.toml")):
        found[path.stem] = tomllib.loads(path.read_text("utf-8"))
    return found


def self_contained_scene(data: Data, folder: Path) -> Data:
    """The scene with complete paths of files, and with the numbers of its signals."""
    for body in data.get("elastic", []):
        for key in {"mesh", "matrices"} & body.keys():
            body[key] = str(folder / body[key])
    if any("file" in signal for signal in data.get("signal", [])):
        signals = load_scene(folder / "scene.toml").signal
        data["signal"] = [
            {**one.model_dump(exclude_none=True), "times": [*one.times], "values": [*one.values]}
            for one in signals
        ]
    return data
