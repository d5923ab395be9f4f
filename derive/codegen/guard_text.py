"""C text of the guards of a straight-line kernel.

No later statement depends on a guard, and a branch would only hinder optimisation of the code after
it.  The function therefore counts how many guards hold before the first failure.  In lanes the
guards are evaluated at the end.
"""

from __future__ import annotations

from mstmm.ir import Guard

from .straight_line import StraightText

#: C name of two numbers: whether all guards hold so far, and how many held before a failure.
GUARDS_NAME = "guards"


class Guards:
    """The guards of one function's text, in their order."""

    def __init__(self, text: StraightText) -> None:
        self._text, self._conditions = text, list[tuple[str, int]]()
        self.in_lanes = text.dialect.vector
        has_guards = any(isinstance(s, Guard) for s in text.kernel.statements)
        #: Whether GUARDS counts them during evaluation.
        self.counts_guards = has_guards and not self.in_lanes

    def prologue(self) -> list[str]:
        """Lines before the first guard."""
        return [f"int {GUARDS_NAME}[2] = {{1, 0}};"] if self.counts_guards else []

    def emit_guard(self, guard: Guard) -> list[str]:
        """Lines of one guard; the count is updated at the next different code."""
        truth, earlier = self._text.truth(guard.condition), self._conditions[-1:]
        self._conditions.append((truth, guard.code))
        if self.in_lanes:
            return []
        is_new_code = any(code != guard.code for _, code in earlier)
        return [f"{GUARDS_NAME}[1] += {GUARDS_NAME}[0];"] * is_new_code + [
            f"{GUARDS_NAME}[0] &= {truth};"
        ]

    def epilogue(self) -> list[str]:
        """Lines after the last guard, which return the failure code of the function."""
        if self.in_lanes:
            return self._lane_lines()
        if not self._conditions:
            return ["return 0;"]
        guard_codes = [code for _, code in self._conditions]
        codes = [code for i, code in enumerate(guard_codes) if not i or guard_codes[i - 1] != code]
        code_list = ", ".join(map(str, [*codes, 0]))
        return [
            f"static const int codes[] = {{{code_list}}};",
            f"return codes[{GUARDS_NAME}[1] + {GUARDS_NAME}[0]];",
        ]

    def _lane_lines(self) -> list[str]:
        lines = ["for (int i = 0; i < MSTMM_LANES; i++) codes[i] = 0;"]
        if not self._conditions:
            return [*lines, "return 0;"]
        every = " & ".join(truth for truth, _ in self._conditions)
        lines.append(f"if (MSTMM_LIKELY(lanes_every({every}))) return 0;")
        lines += [f"lanes_fail(codes, {truth}, {code});" for truth, code in self._conditions]
        return [*lines, "return 1;"]
