"""Page of the cost charts: recommended settings for two errors."""

from __future__ import annotations

from typing import Any

from .comparison import OWN


def setting_text(point: dict[str, Any]) -> str:
    """Method or program, variant and setting of a point."""
    value = (
        f"step {point['value']:.2g} s" if point["has_fixed_steps"] else f"rtol {point['value']:.0e}"
    )
    return ", ".join(part for part in (point["method"], point["variant"], value) if part)


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
    machine, results = record["machine"], record["results"]
    return _PAGE.format(
        picture=picture, rounds=record["rounds"], processor=machine["processor"],
        cores=machine["cores"],
        load=machine["load"], table=table(record), scenes="\n".join(map(scene, results)),
        everybody="\n\n".join(map(all_programs, results)),
    )  # fmt: skip


def table(record: dict[str, Any]) -> str:
    """Recommended settings for every scene and error."""
    lines = [
        "| scene | error | mstmm | CPU ms | best peer | CPU ms | mstmm / peer |", "|---" * 7 + "|",
    ]  # fmt: skip
    for result in record["results"]:
        lines += [row(result, target) for target in result["recommended"]]
    return "\n".join(lines)


def scene(result: dict[str, Any]) -> str:
    """Scene, programs, and reasons of missing ones."""
    tools = ", ".join(tool for tool in result["fronts"] if tool != OWN) or "none"
    return (
        f"- **{result['case']}**: {result['title']}, {result['t_end_s']:g} s, error of "
        f"`{result['end']}`; engines: {', '.join(result['engines'])}; the reference's own error is "
        f"{result['reference']['error']:.1e} m; the shortest call of `simulate` takes "
        f"{result['shortest_call_ms']:.2g} ms. Peers: {tools}."
        + "".join(f" Left out: {why}." for why in result["missing"])
    )


def row(result: dict[str, Any], target: str) -> str:
    """A line of the table."""
    recommended = result["recommended"][target]
    own_point, peer = recommended["tools"][OWN], recommended["best_peer"]
    cells = [result["case"], f"{float(target):.0e} m", *cell(own_point)]
    cells += cell(recommended["tools"][peer]) if peer else ["none meets it", ""]
    cells.append("" if recommended["ratio"] is None else f"{recommended['ratio']:.3g}")
    return f"| {' | '.join(cells)} |"


def cell(point: dict[str, Any]) -> list[str]:
    """Words and CPU ms."""
    if "missed" in point:
        return ["none meets it", ""]
    return [setting_text(point), f"{point['cpu_ms']:.3g}"]


def all_programs(result: dict[str, Any]) -> str:
    """CPU ms of all programs for all target errors."""
    targets = list(result["recommended"])
    lines = [
        f"**{result['case']}**", "",
        f"| tool | {' | '.join(f'{float(target):.0e} m' for target in targets)} |",
        "|---" * (len(targets) + 1) + "|",
    ]  # fmt: skip
    for tool in result["fronts"]:
        points = [result["recommended"][target]["tools"][tool] for target in targets]
        texts = ["" if "missed" in p else f"{p['cpu_ms']:.3g} ({setting_text(p)})" for p in points]
        lines.append(f"| {tool} | {' | '.join(texts)} |")
    return "\n".join(lines)
