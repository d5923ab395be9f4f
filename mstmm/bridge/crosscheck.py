"""Cross-check of the kernels of an element in three forms, and of statements of mechanics.

The three forms are the stated equations at 50 digits (`derive.audit.evaluate_equations`), the IR at
50 digits, and the compiled C in doubles (where there is no C, the engine's interpreter).  The error
of C must not exceed the rounding bound of a running error analysis.  They are compared at random
points, and at points where a formula could fail.  `derive.audit.properties` has the statements of
mechanics.

    report = mstmm.bridge.crosscheck.crosscheck("hinge", "pin")
    print(report); report.passed
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from ..errors import ElementError
from ..ir import KernelIR
from ..ir.spec import ElementSpec
from ..ir.statements import NEGATIVE
from ..ir.tape import Tape, compile_tape
from .report import KernelCheck, Report, Statement

if TYPE_CHECKING:
    from ..derive.audit.properties import Property
    from ..derive.audit.samples import Source
    from ..derive.catalogue.kernels import Kernel
    from ..derive.catalogue.registry import Element as Definition
    from ..runtime.kernels.prebuilt import Element as Compiled

#: Largest accepted relative difference between specialised and generic kernels in doubles.
SPECIALISED = 1e-13
#: Largest accepted deviation of a derivative from its difference quotient at 60 digits.
DIFFERENCES = 1e-25


# --- subjects of a check --------------------------------------------------------------------------


def crosscheck(kind: str, name: str, points: int = 2) -> Report:
    """Check a built-in element, or one of the kernel store (its IR and C; its file is not run).

    `points` is the number of random points per kernel in addition to the special ones.  Raises
    ElementError for an unknown name.
    """
    from ..derive.catalogue.kernels import maker
    from ..derive.catalogue.registry import builtin_elements, kind_of
    from ..ir.stored import element_from_json
    from ..runtime.kernels import prebuilt, store

    make, compiled = maker(kind, name), prebuilt.elements().get((kind, name))
    if make is not None:
        kernels = make()
        element = next(
            (e for e in builtin_elements() if (kind_of(e), e.name) == (kind, name)), None
        )
        subject = replace(_subject(kind, name, element, kernels, compiled), interpreted=True)
        return subject.report(points, ())
    if compiled is not None:  # instances of other elements with some known numbers
        text = (files("mstmm") / "generated" / f"{kind}_{name}.json").read_text(encoding="utf-8")
        subject = _Subject.stored(element_from_json(text), compiled)
        return subject.report(points, ("its equations are those of the general element",))
    stored = store.spec((kind, name))
    if stored is None:
        raise ElementError(f"there is no {kind} named {name!r}; mstmm list shows all elements")
    compiled = store.opened((kind, name), stored.hash())
    subject = _Subject.stored(stored, compiled)
    return subject.report(
        points, ("its definition is not stored; give its file to check the equations too",)
    )


def crosscheck_definition(element: Definition, points: int = 2) -> Report:
    """Check a user-defined element with its equations, and its C if the store has it."""
    from ..derive.catalogue.kernels import kernels_of
    from ..derive.catalogue.registry import kind_of
    from ..derive.catalogue.specs import spec_from
    from ..runtime.kernels import store

    kernels, key = kernels_of(element), (kind_of(element), element.name)
    stored = store.spec(key)
    current = stored is not None and stored.hash() == spec_from(element, kernels).hash()
    compiled = store.opened(key, stored.hash()) if stored is not None and current else None
    return crosscheck_kernels(*key, element, kernels, compiled, points)


def mechanics(
    kind: str, name: str, kernels: Sequence[Kernel], element: Definition | None = None
) -> tuple[Statement, ...]:
    """Statements of mechanics only, for kernels whose derivations are given."""
    subject = _subject(kind, name, element, kernels, None)
    return tuple(Statement(*found) for found in subject.statements())


def crosscheck_kernels(
    kind: str,
    name: str,
    element: Definition | None,
    kernels: Sequence[Kernel],
    compiled: Compiled | None,
    points: int,
) -> Report:
    """Check kernels whose derivations are given, and the compiled element if there is one."""
    remarks = () if compiled is not None else ("not generated yet, so there is no C to compare",)
    return _subject(kind, name, element, kernels, compiled).report(points, remarks)


def _subject(
    kind: str,
    name: str,
    element: Definition | None,
    kernels: Sequence[Kernel],
    compiled: Compiled | None,
) -> _Subject:
    from ..derive.audit.samples import Source
    from ..derive.catalogue.slopes import with_slopes
    from ..derive.equations.hinge import speeds_of
    from ..derive.language.element import Hinge

    hinge = element if isinstance(element, Hinge) else None
    nu = len(speeds_of(hinge)) if hinge else 0
    if kind == "sweep" and name.startswith("generic"):
        nu = int(name.removeprefix("generic"))
    coordinates = hinge.coordinates if hinge else ()
    source = Source(kind, coordinates, element.parameters if element else ())
    group = kind if kind != "sweep" else name.rstrip("0123456789")
    irs = {ir.name: ir for ir in with_slopes(group, (kernel.ir() for kernel in kernels))}
    derivations = {kernel.name: kernel for kernel in kernels}
    return _Subject(kind, name, nu, source, irs, derivations, compiled)


@dataclass(frozen=True)
class _Subject:
    """Kernels of an element in their three forms; `stated` is empty for a stored element."""

    kind: str
    name: str
    nu: int
    source: Source
    irs: Mapping[str, KernelIR]
    stated: Mapping[str, Kernel]
    compiled: Compiled | None
    interpreted: bool = False  # kernels without a C function, by the engine's interpreter

    @classmethod
    def stored(cls, spec: ElementSpec, compiled: Compiled) -> _Subject:
        from ..derive.audit.samples import Source

        source = Source(spec.kind, spec.coordinates, spec.parameters)
        irs = {kernel.name: kernel for kernel in spec.kernels}
        return cls(spec.kind, spec.name, len(spec.speeds), source, irs, {}, compiled)

    def report(self, points: int, remarks: tuple[str, ...]) -> Report:
        checks = tuple(self._kernel(kernel, points) for kernel in self.irs.values())
        statements = tuple(Statement(*found) for found in self._judged())
        return Report(self.kind, self.name, checks, statements, remarks)

    # --- one kernel -----------------------------------------------------------------------------

    def _kernel(self, kernel: KernelIR, points: int) -> KernelCheck:
        worst, where, stopped, count = [0.0, 0.0], "", 0, 0
        problems: list[str] = []
        c_seen = self._function(kernel) is not None
        interpreted = c_seen and not self._has_c(kernel)
        for point in self.source.points(kernel, points):
            count += 1
            compared = self._compare(kernel, point.inputs, point.n)
            if isinstance(compared, str):
                problems.append(f"at {point.label!r}: {compared}")
            elif compared is None:
                stopped += 1
            else:
                if compared[0] > worst[0] or compared[1] > worst[1]:
                    where = point.label
                worst = [max(a, b) for a, b in zip(worst, compared, strict=True)]
        return KernelCheck(
            kernel.name, count, stopped, worst[0] if kernel.name in self.stated else None,
            worst[1] if c_seen else None, where, tuple(problems), interpreted,
        )  # fmt: skip

    def _compare(
        self, kernel: KernelIR, inputs: dict[str, list[float]], n: int
    ) -> tuple[float, float] | str | None:
        """Errors (equations, compiled); None if guards stop all forms; text if they disagree."""
        from mstmm.ir.replay import GuardFailure

        from ..derive.audit.evaluate import evaluate
        from ..derive.audit.evaluate_equations import Undefined, evaluate_equations

        code, exact = 0, None
        try:
            exact = evaluate(kernel, inputs, n=n)
        except GuardFailure as failure:
            code = failure.code
        stated = None
        if kernel.name in self.stated:
            form = self.stated[kernel.name]
            try:
                stated = evaluate_equations(form.derivation, inputs, form.guards, n=n)
            except Undefined as undefined:
                if exact is not None and _finite(exact):
                    return f"the equations have no value ({undefined}), the IR has one"
                return None
        rounded = {name: [float(v) for v in row] for name, row in inputs.items()}  # as C has them
        found = self._c_values(kernel, rounded, n)
        if found is not None and found[0] not in (code, NEGATIVE):
            return f"C returns {found[0]}, the IR {code}"
        if exact is None or not _finite(exact):
            return None
        first = 0.0 if stated is None else _difference(exact, stated.outputs, inputs)
        if stated is not None and stated.asymmetry > 1e-30 * _size(inputs):
            return "a quantity declared as symmetric is not symmetric"
        second = 0.0 if found is None else self._share(kernel, rounded, found[1], n)
        return first, second

    def _share(
        self,
        kernel: KernelIR,
        inputs: dict[str, list[float]],
        got: Mapping[str, Sequence[float]],
        n: int,
    ) -> float:
        """Largest error of C relative to its rounding bound."""
        from ..derive.audit.rounding import rounding_bounds

        worst = 0.0
        for name, limits in rounding_bounds(kernel, inputs, n).items():
            for value, (exact, bound) in zip(got[name], limits, strict=True):
                worst = max(
                    worst, float(abs(value - exact)) / bound if value == value else math.inf
                )
        return worst

    # --- the compiled kernels -------------------------------------------------------------------

    def _function(self, kernel: KernelIR) -> Callable[..., Any] | None:
        if self.compiled is not None and self._has_c(kernel):
            return partial(_call, self.compiled)
        if self.compiled is not None and self.compiled.tape is not None:
            return partial(_interpret, self.compiled.tape) if kernel.name == "hinge" else None
        return partial(_interpret, _tape(kernel)) if self.interpreted else None

    def _has_c(self, kernel: KernelIR) -> bool:
        return self.compiled is not None and kernel.name in self.compiled.functions

    def _c_values(
        self, kernel: KernelIR, inputs: dict[str, list[float]], n: int
    ) -> tuple[int, dict[str, list[float]]] | None:
        function = self._function(kernel)
        return None if function is None else function(kernel, inputs, n)

    # --- statements of mechanics ------------------------------------------------------------------

    def _precisely(self, name: str, inputs: dict[str, Any]) -> dict[str, list[Any]]:
        """Evaluate a kernel at high precision, by its equations if available, else its IR."""
        from ..derive.audit.evaluate import evaluate
        from ..derive.audit.evaluate_equations import evaluate_equations
        from ..derive.audit.properties import DIGITS

        if self.stated:
            return evaluate_equations(self.stated[name].derivation, inputs, (), DIGITS).outputs
        return evaluate(self.irs[name], inputs, DIGITS)

    def _judged(self) -> list[tuple[str, float, float]]:
        """Evaluate all statements of mechanics.

        ElementError if the equations have no value for numbers within the bounds of the definition.
        """
        from ..derive.audit.evaluate_equations import Undefined

        try:
            return list(self.statements())
        except Undefined as undefined:
            what = str(undefined)
            for k, parameter in enumerate(self.source.parameters):
                what = what.replace(f"p[{k}, 0]", f"p.{parameter.name}")
            raise ElementError(
                f"{self.kind} {self.name}: {what} for some numbers that its definition allows; "
                'give bounds of parameters and coordinates, such as Param("width", "m", minimum=0)'
            ) from None

    def statements(self) -> Iterator[tuple[str, float, float]]:
        from ..derive.audit import law_properties, properties
        from ..derive.audit.slopes import slope_errors

        found: tuple[Property, ...] = ()
        p = next((port.length() for kernel in self.irs.values() for port in kernel.inputs
                  if port.name == "p"), 0)  # fmt: skip
        if self.kind == "hinge":
            generic = partial(_generic, self.nu)
            found = properties.hinge_properties(self._precisely, generic, self.source, self.nu)
            yield from self._in_doubles()
        elif self.kind == "body":
            found = properties.body_properties(self._precisely, self.source, p)
        elif self.kind == "force":
            found = properties.force_properties(self._precisely, self.source, p)
        elif self.name.startswith("generic"):
            found = properties.sweep_properties(self._precisely, self.nu)
        elif (self.kind, self.name) == ("sweep", "laws"):
            for kernel, each in law_properties.law_properties(
                self._precisely, self.source, self.irs
            ):
                yield f"{kernel}: {each.name}", each.error, each.limit
        for each in found:
            yield each.name, each.error, each.limit
        for kernel, error in slope_errors(self.irs, self.source):
            yield f"{kernel} = difference quotient", error, DIFFERENCES

    def _in_doubles(self) -> Iterator[tuple[str, float, float]]:
        """Compare the compiled specialised kernels with the compiled generic ones."""
        from ..derive.catalogue.kernels import generic_kernels
        from ..runtime.kernels import prebuilt

        if self.compiled is None or self.compiled.tape is not None:
            return
        generic = prebuilt.element("sweep", f"generic{self.nu}")
        shared = {kernel.name: kernel for kernel in generic_kernels(self.nu)}
        for name in ("forward", "condense", "recover"):
            worst, other = 0.0, shared[name].ir()
            for point in self.source.points(self.irs[name], 3):
                own = {"u": [0.0] * self.nu} | point.inputs
                _, relative = _call(self.compiled, self.irs["hinge"], own)
                code, one = _call(self.compiled, self.irs[name], own)
                refused, two = _call(generic, other, relative | own | {"J": [0.0] * self.nu})
                if not (code or refused):
                    worst = max(worst, _deviation(one, two, own))
            yield f"{name} in C: specialised = generic", worst, SPECIALISED


# --- calls ----------------------------------------------------------------------------------------


def _generic(nu: int, name: str, inputs: dict[str, Any]) -> dict[str, list[Any]]:
    from ..derive.audit.evaluate_equations import evaluate_equations
    from ..derive.audit.properties import DIGITS
    from ..derive.catalogue.kernels import generic_kernels

    kernel = next(k for k in generic_kernels(nu) if k.name == name)
    return evaluate_equations(kernel.derivation, inputs, (), DIGITS).outputs


def _call(
    compiled: Compiled, kernel: KernelIR, inputs: Mapping[str, Sequence[float]], n: int = 0
) -> tuple[int, dict[str, list[float]]]:
    """Call a compiled kernel through its descriptor: (code, outputs)."""
    from ..border.elements import c_outputs
    from ..runtime.kernels import prebuilt

    ffi, _ = prebuilt.module()
    descriptor = compiled.descriptor
    found = next(
        descriptor.kernels[i]
        for i in range(descriptor.n_kernels)
        if prebuilt.text(ffi, descriptor.kernels[i].name) == kernel.name
    )
    given = [ffi.new("real[]", list(inputs[port.name]) or 1) for port in kernel.inputs]
    taken = [ffi.new("real[]", max(1, port.length(n))) for port in c_outputs(kernel)]
    code = found.call(n, ffi.new("real *[]", given or 1), ffi.new("real *[]", taken or 1))
    return int(code), _named(kernel, taken, n)


def _named(kernel: KernelIR, arrays: Sequence[Any], n: int = 0) -> dict[str, list[float]]:
    """Outputs by name, without a work array that may follow them."""
    return {
        port.name: list(array)[: port.length(n)]
        for port, array in zip(kernel.outputs, arrays, strict=False)
    }


@lru_cache(maxsize=1)  # all points of a kernel, one after the other
def _tape(kernel: KernelIR) -> Tape:
    return compile_tape(kernel)


def _interpret(
    tape: Any, kernel: KernelIR, inputs: Mapping[str, Sequence[float]], n: int = 0
) -> tuple[int, dict[str, list[float]]]:
    """Interpret a kernel without a C function as the engine does: (code, outputs)."""
    from ..runtime.kernels import prebuilt
    from ..runtime.kernels.tape import c_tape

    ffi, lib = prebuilt.module()
    kept: list[Any] = []
    given = [ffi.new("real[]", list(inputs[port.name]) or 1) for port in kernel.inputs]
    taken = [ffi.new("real[]", max(1, port.length())) for port in kernel.outputs]
    slots, packed = ffi.new("real[]", tape.slots), c_tape(ffi, tape, kept)
    code = lib.mstmm_tape_run(
        packed, ffi.new("real *[]", given or 1), slots, ffi.new("real *[]", taken or 1)
    )
    return int(code), _named(kernel, taken)


# --- numbers --------------------------------------------------------------------------------------


def _size(inputs: Mapping[str, Sequence[float]]) -> float:
    return max((abs(v) for row in inputs.values() for v in row if abs(v) < 1e200), default=1.0)


def _deviation(
    one: Mapping[str, Sequence[float]],
    two: Mapping[str, Sequence[float]],
    inputs: Mapping[str, Sequence[float]],
) -> float:
    """Largest difference of outputs, relative to the largest entries of `two`."""
    worst = 0.0
    for name, row in two.items():
        scale = max([abs(v) for v in row] + _entering(name, inputs))
        gaps = (abs(a - b) for a, b in zip(one[name], row, strict=True))
        worst = max(worst, max(gaps, default=0.0) / scale)
    return worst


def _entering(name: str, inputs: Mapping[str, Sequence[float]]) -> list[float]:
    """Magnitudes of the inputs that an output is a remainder of: S_I of S, e_I of e and tau."""
    names = {"S_I": ("S",), "e_I": ("e", "tau")}.get(name, ())
    return [1e-300, *(abs(v) for each in names for v in inputs[each])]


def _finite(values: Mapping[str, Sequence[Any]]) -> bool:
    import mpmath

    return all(mpmath.isfinite(v) for row in values.values() for v in row)


def _difference(
    exact: Mapping[str, Sequence[Any]],
    stated: Mapping[str, Sequence[Any]],
    inputs: Mapping[str, Sequence[float]],
) -> float:
    """Largest difference, relative to the largest entry of its array and to the inputs."""
    floor, worst = 1e-8 * _size(inputs), 0.0
    for name, row in exact.items():
        scale = max([abs(v) for v in row] + [floor])
        if scale == 0:
            continue
        for a, b in zip(row, stated[name], strict=True):
            worst = max(worst, float(abs(a - b) / scale))
    return worst


__all__ = [
    "KernelCheck",
    "Report",
    "Statement",
    "crosscheck",
    "crosscheck_definition",
    "crosscheck_kernels",
    "mechanics",
]
