"""Output of `mstmm simulate` about a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mstmm.errors import RiskRefused

if TYPE_CHECKING:
    from mstmm.runtime.result.result import Result
    from mstmm.runtime.result.verdict import Verdict

    from .plan import Plan

#: Number of rows of the table on the terminal.
_ROWS = 9


def interrupted(result: Result) -> bool:
    """Whether Ctrl-C or SIGTERM ended the run."""
    return result.status is None


def report(
    plan: Plan, result: Result, seconds: float, json: bool, refused: RiskRefused | None
) -> None:
    """Report a run on the terminal or as JSON."""
    from .. import output, summary

    made = [str(path) for path in (plan.output, plan.plot) if path is not None]
    if json:
        data = summary.to_json(result, seconds, _verdict(plan, result))
        data |= {"scene": plan.scene, "files": made}
        if refused is not None:
            data["error"] = {
                "type": type(refused).__name__, "message": str(refused),
                "exit_code": refused.exit_code,
            }  # fmt: skip
        if interrupted(result) and plan.resumable:
            data["checkpoint"] = str(plan.checkpoint)
        output.emit_json(data)
    else:
        _say(plan, result, seconds, made)
    if interrupted(result) and plan.resumable:
        output.complain(f"{result.message}; continue with the same command and --resume")
    elif interrupted(result):
        output.complain(f"{result.message}; the result so far is in {plan.output}")
    elif not result.success:
        output.complain(f"{plan.scene}: {result.message}; the result so far is in {plan.output}")


def _verdict(plan: Plan, result: Result) -> Verdict:
    given = result.certificate
    return given.verdict() if plan.accuracy is None else given.verdict(plan.accuracy)


def _say(plan: Plan, result: Result, seconds: float, made: list[str]) -> None:
    from .. import output, summary

    console = output.console()
    verdict, told = _verdict(plan, result), result.trajectory.told
    for line in summary.verdict_lines(verdict, console.width, told):
        output.say(line)
    output.say(f"{plan.scene}: {summary.sizes(result)}, {summary.engine(result)}")
    output.say(summary.effort(result, seconds))
    if packed := summary.simplified(result):
        output.say(f"  {packed}")
    for line in summary.method_lines(result, console.width):
        output.say(line)
    output.say(result.message)
    if len(result.t):
        output.say()
        output.say(summary.fitting_table(result, plan.quantities, _ROWS, console.width))
    output.say()
    for line in summary.certificate_lines(result, console.width):
        output.say(line)
    output.say()
    output.say(f"wrote {' and '.join(made)} ({summary.count(len(result.t), 'sample')})")


def told_risks(plan: Plan, refused: RiskRefused) -> int:
    """Print the risks of a rejected result, and return the exit code."""
    from .. import output

    output.complain(f"{plan.scene}: {refused}\nthe result is in {plan.output}")
    return refused.exit_code
