"""The standing charts as a page: what to take for two errors, beside the best peer."""

from __future__ import annotations

from typing import Any

from .side_by_side import OWN


def words(point: dict[str, Any]) -> str:
    """Method or tool, manner and setting of a point."""
    value = f"step {point['value']:.2g} s" if point["fixed"] else f"rtol {point['value']:.0e}"
    return ", ".join(part for part in (point["method"], point["manner"], value) if part)


_PAGE = """\
# Benchmark: eight scenes against other programs

Find the cheapest method for eight scenes and two errors, in mstmm and in other programs. The charts
show every method of mstmm over its tolerances or steps, on both engines (the fused one up to 20
speeds, compiled before), as made by `mstmm chart`. SciPy and SUNDIALS use the compiled equations of
mstmm with their exact Jacobian; other programs are included where they can model the scene.
Written by `python -m benchmarks.scene_suite`.

![CPU time over achieved error of eight scenes, mstmm and its peers]({picture})

## Recommended settings

The cheapest setting of mstmm whose error in the final position of one end, and that of all tighter
settings of its method, is within the limit; next to it the cheapest of the best peer. CPU time of
one whole warm call that gives the final state (`simulate`, `solve_ivp`, a loop in C,
`SolveDynamic`), without preparation, minimum of {rounds} alternating rounds. A call of `simulate`
checks its arguments, creates a result and keeps data for its certificate; the C of CasADi and
Pinocchio runs in a bare loop. For short motions this is the difference.
{processor}, {cores} cores, load {load:.1f}: only ratios carry over to other machines.

{table}

## The scenes

{scenes}

## All programs

{everybody}
"""


def page(record: dict[str, Any], picture: str) -> str:
    """The whole page, with the picture at a path relative to it."""
    at, results = record["machine"], record["results"]
    return _PAGE.format(
        picture=picture, rounds=record["rounds"], processor=at["processor"], cores=at["cores"],
        load=at["load"], table=table(record), scenes="\n".join(map(scene, results)),
        everybody="\n\n".join(map(everybody, results)),
    )  # fmt: skip


def table(record: dict[str, Any]) -> str:
    """What to take for every scene and error."""
    lines = [
        "| scene | error | mstmm | CPU ms | best peer | CPU ms | mstmm / peer |", "|---" * 7 + "|",
    ]  # fmt: skip
    for result in record["results"]:
        lines += [row(result, asked) for asked in result["recommended"]]
    return "\n".join(lines)


def scene(result: dict[str, Any]) -> str:
    """What was run, and who could not."""
    tools = ", ".join(tool for tool in result["fronts"] if tool != OWN) or "none"
    return (
        f"- **{result['case']}**: {result['title']}, {result['t_end_s']:g} s, error of "
        f"`{result['of']}`; engines: {', '.join(result['engines'])}; the reference's own error is "
        f"{result['reference']['error']:.1e} m; the shortest call of `simulate` takes "
        f"{result['shortest_call_ms']:.2g} ms. Peers: {tools}."
        + "".join(f" Left out: {why}." for why in result["missing"])
    )


def row(result: dict[str, Any], asked: str) -> str:
    """A line of the table."""
    found = result["recommended"][asked]
    own, peer = found["tools"][OWN], found["best_peer"]
    cells = [result["case"], f"{float(asked):.0e} m", *cell(own)]
    cells += cell(found["tools"][peer]) if peer else ["none meets it", ""]
    cells.append("" if found["ratio"] is None else f"{found['ratio']:.3g}")
    return f"| {' | '.join(cells)} |"


def cell(point: dict[str, Any]) -> list[str]:
    """Words and CPU ms."""
    if "missed" in point:
        return ["none meets it", ""]
    return [words(point), f"{point['cpu_ms']:.3g}"]


def everybody(result: dict[str, Any]) -> str:
    """CPU ms of every tool for the errors that are asked."""
    asked = list(result["recommended"])
    lines = [
        f"**{result['case']}**", "",
        f"| tool | {' | '.join(f'{float(x):.0e} m' for x in asked)} |",
        "|---" * (len(asked) + 1) + "|",
    ]  # fmt: skip
    for tool in result["fronts"]:
        points = [result["recommended"][x]["tools"][tool] for x in asked]
        texts = ["" if "missed" in p else f"{p['cpu_ms']:.3g} ({words(p)})" for p in points]
        lines.append(f"| {tool} | {' | '.join(texts)} |")
    return "\n".join(lines)
