"""Output of `mstmm simulate` about a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mstmm.errors import RiskRefused

if TYPE_CHECKING:
    from mstmm.runtime.result.result import Result
    from mstmm.runtime.result.verdict import Verdict

    from .run_options import RunOptions

#: Number of rows of the table on the terminal.
_TABLE_ROWS = 9


def was_interrupted(result: Result) -> bool:
    """Whether Ctrl-C or SIGTERM ended the run."""
    return result.status is None


def report_run(
    plan: RunOptions, result: Result, seconds: float, refused: RiskRefused | None
) -> None:
    """Report a run on the terminal or as JSON."""
    from .. import run_summary, terminal_output

    files_written = [str(path) for path in (plan.result_file, plan.plot_file) if path is not None]
    if plan.json:
        data = run_summary.to_json(result, seconds, _plan_verdict(plan, result))
        data |= {"scene": plan.scene, "files": files_written}
        if refused is not None:
            data["error"] = {
                "type": type(refused).__name__, "message": str(refused),
                "exit_code": refused.exit_code,
            }  # fmt: skip
        if was_interrupted(result) and plan.resumable:
            data["checkpoint"] = str(plan.checkpoint)
        terminal_output.print_json(data)
    else:
        _print_report(plan, result, seconds, files_written)
    if was_interrupted(result) and plan.resumable:
        terminal_output.print_error(
            f"{result.message}; continue with the same command and --resume"
        )
    elif was_interrupted(result):
        terminal_output.print_error(f"{result.message}; the result so far is in {plan.result_file}")
    elif not result.success:
        terminal_output.print_error(
            f"{plan.scene}: {result.message}; the result so far is in {plan.result_file}"
        )


def _plan_verdict(plan: RunOptions, result: Result) -> Verdict:
    certificate = result.certificate
    return certificate.verdict() if plan.accuracy is None else certificate.verdict(plan.accuracy)


def _print_report(plan: RunOptions, result: Result, seconds: float, made: list[str]) -> None:
    from .. import run_summary, terminal_output

    console = terminal_output.table_console()
    verdict, has_reasons = _plan_verdict(plan, result), result.trajectory.reported_risks
    for line in run_summary.verdict_lines(verdict, console.width, has_reasons):
        terminal_output.print_lines(line)
    terminal_output.print_lines(
        f"{plan.scene}: {run_summary.size_text(result)}, {run_summary.engine_text(result)}"
    )
    terminal_output.print_lines(run_summary.effort_text(result, seconds))
    if simplifications := run_summary.simplification_counts(result):
        terminal_output.print_lines(f"  {simplifications}")
    for line in run_summary.method_lines(result, console.width):
        terminal_output.print_lines(line)
    terminal_output.print_lines(result.message)
    if len(result.t):
        terminal_output.print_lines()
        terminal_output.print_lines(
            run_summary.fitting_table(
                result, tuple(plan.quantity or ()), _TABLE_ROWS, console.width
            )
        )
    terminal_output.print_lines()
    for line in run_summary.certificate_lines(result, console.width):
        terminal_output.print_lines(line)
    terminal_output.print_lines()
    terminal_output.print_lines(
        f"wrote {' and '.join(made)} ({run_summary.count_text(len(result.t), 'sample')})"
    )


def print_risks(plan: RunOptions, refused: RiskRefused) -> int:
    """Print the risks of a rejected result, and return the exit code."""
    from .. import terminal_output

    terminal_output.print_error(f"{plan.scene}: {refused}\nthe result is in {plan.result_file}")
    return refused.exit_code
