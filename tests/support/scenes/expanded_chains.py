"""A scene with chains written out body by body, from its data alone."""

from __future__ import annotations

import re
from typing import Any

Data = dict[str, Any]

_MEMBER = re.compile(r"\b([a-z]\w*)\[(\d+|last)\]")


def written_out(data: Data) -> Data:
    """The same scene without chains: members become bodies rope_3 on hinges rope_3_hinge.

    What hangs on members comes behind them, so that the trees have one order; q and u have another
    one, because the scene's own hinges come first where there are chains.
    """
    counts = {chain["name"]: chain["count"] for chain in data["chain"]}

    def rename_nested_members(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: rename_nested_members(x) for key, x in value.items()}
        if isinstance(value, list):
            return [rename_nested_members(x) for x in value]
        return rename_members(value) if isinstance(value, str) else value

    def rename_members(text: str) -> str:
        text = re.sub(r"\b(\w+)\[(\d+|last)\]\.hinge", lambda m: _name(m, counts) + "_hinge", text)
        return _MEMBER.sub(lambda m: _name(m, counts) if m[1] in counts else m[0], text)

    found: Data = {key: value for key, value in data.items() if key != "chain"}
    bodies, hinges = [], []
    for chain in data["chain"]:
        for k in range(chain["count"]):
            bodies.append(_body(chain, k))
            hinges.append(rename_nested_members(_hinge(chain, k)))
    found["body"] = bodies + data.get("body", [])
    found["hinge"] = hinges + rename_nested_members(data.get("hinge", []))
    for table in ("load", "spring", "event"):
        found[table] = rename_nested_members(data.get(table, []))
    return found


def _name(match: re.Match[str], counts: dict[str, int]) -> str:
    k = counts[match[1]] - 1 if match[2] == "last" else int(match[2])
    return f"{match[1]}_{k}"


def _pattern(tables: Any, k: int) -> Data:
    if isinstance(tables, dict):
        return tables
    table: Data = tables[k % len(tables)]
    return table


def _body(chain: Data, k: int) -> Data:
    return {"name": f"{chain['name']}_{k}", **_pattern(chain["body"], k)}


def _hinge(chain: Data, k: int) -> Data:
    name = chain["name"]
    hinge = {"name": f"{name}_{k}_hinge", "outboard": f"{name}_{k}", **_pattern(chain["hinge"], k)}
    if k == 0:
        place: Data = {key: chain[key] for key in ("position", "orientation") if key in chain}
        return {**hinge, "inboard": chain["inboard"], **place}
    end = chain.get("end") or next(iter(_pattern(chain["body"], k - 1)["ends"]))
    return {**hinge, "inboard": f"{name}_{k - 1}.{end}"}


def plain_name(name: str) -> str:
    """rope_3_hinge.angle of rope[3].hinge.angle; other names as they are."""
    return re.sub(r"\[(\d+)\](\.hinge)?", lambda m: f"_{m[1]}" + ("_hinge" if m[2] else ""), name)
