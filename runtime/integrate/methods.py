"""Integration methods as objects: a name with the options of its family.

    model.simulate(10.0, mstmm.methods.GeneralizedAlpha(radius=0.5), step=0.01)

A name alone, such as "genalpha", stands for the object with default options.  The fields declare
each option once: the command line takes names, units and texts from them.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

from mstmm.argument_validation import require_word
from mstmm.errors import SceneError

EXPLICIT = ("rk4", "dopri5", "dop853", "pirk13")
IMPLICIT = (
    "rodas4", "rodas4p2", "rodas5p", "ros34pw2", "rodas4pw", "esdirk436", "kvaerno5",
    "genalpha", "dttmm", "hht", "newmark", "wilson", "houbolt", "exprb32",
    "genalpha-index3", "hht-index3",
)  # fmt: skip

#: Methods whose spectral radius at infinity a run may choose.
METHODS_WITH_RADIUS = ("genalpha", "dttmm", "genalpha-index3")

#: Tangents of the equations of motion for implicit methods, in the order of the C loop's numbers:
#: auto is the exact one for Rosenbrock methods; iterations first try that of inertia and laws.
TANGENTS = ("auto", "exact", "laws")

_CLASSICAL = ("dttmm-classical", "dttmm-classical-product")


def _option(default: Any, metavar: str, description: str) -> Any:
    metadata = {"metavar": metavar, "description": description}
    return field(default=default, metadata=metadata, kw_only=True)


@dataclass(frozen=True)
class Method:
    """Integration method by name, with limits of its steps.

    Names: rk4 (with a fixed step), dopri5, dop853, pirk13 (order 13, for smooth motions on fused
    code); auto, which is dop853 until stability sets its steps, then rodas4p2 (rtol from 1e-5 on)
    or rodas5p, and back; for stiff motion rodas4p2, rodas5p, rodas4, ros34pw2, rodas4pw, esdirk436,
    kvaerno5, genalpha, dttmm, hht, newmark, wilson or houbolt; genalpha-index3 and hht-index3,
    which close loops by positions; exprb32 for undamped vibration of few unknowns; scipy-DOP853,
    scipy-RK45, scipy-Radau, scipy-BDF, scipy-LSODA, sundials-BDF, sundials-Adams: integrators of
    SciPy and SUNDIALS on the same kernels; dttmm-classical, dttmm-classical-product (with a fixed
    step): the discrete-time transfer matrix method in absolute coordinates.

    Attributes:
        name: a name of `mstmm list methods`; "" for the automatic choice.
        max_step: longest step of an adaptive method, s; 0 for no limit.
        max_steps: largest number of steps; 0 for no limit.
    """

    name: str = ""
    max_step: float = _option(
        0.0, "S", "Maximum time step of adaptive methods, s; use it when a force is narrow."
    )
    max_steps: int = _option(0, "N", "Maximum number of steps.")

    @property
    def options(self) -> dict[str, Any]:
        """Options by name."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name != "name"}


@dataclass(frozen=True)
class Implicit(Method):
    """Implicit method for stiff motion.

    Attributes:
        tangent: tangent matrix: "exact"; "laws", inertia and the slopes of hinge laws alone, for
            methods that iterate and for ros34pw2 and rodas4pw; "auto", exact except where
            iterations may begin with "laws".
    """

    name: str = "rodas4p2"
    tangent: str = _option(
        TANGENTS[0], "NAME",
        "Tangent matrix of implicit methods: exact, laws (hinge laws only) or auto.",
    )  # fmt: skip


@dataclass(frozen=True)
class GeneralizedAlpha(Implicit):
    """Generalised-alpha method: genalpha, genalpha-index3 or dttmm.

    Attributes:
        radius: spectral radius at infinity, 0 to 1; None for 0.8.  Below 1 with genalpha-index3.
    """

    name: str = "genalpha"
    radius: float | None = _option(
        None, "X", "Spectral radius at infinity of genalpha and dttmm, 0 to 1 (0.8)."
    )


@dataclass(frozen=True)
class ClassicalDiscreteTime(Method):
    """Classical discrete-time transfer matrix method in absolute coordinates.

    Attributes:
        scheme: "generalised-alpha", "hht", "newmark" or "wilson", with a parameter as in "hht:0.3".
        iterations: largest number of linear solutions per step.
    """

    name: str = _CLASSICAL[0]
    scheme: str = _option(
        "", "NAME",
        "Time scheme of dttmm-classical: generalised-alpha, hht, newmark, wilson; parameter as in "
        "hht:0.3.",
    )  # fmt: skip
    iterations: int = _option(1, "N", "Maximum Newton iterations per step of dttmm-classical.")


#: All classes, the most special ones first.
FAMILIES = (GeneralizedAlpha, ClassicalDiscreteTime, Implicit, Method)


def method(name: str, **options: Any) -> Method:
    """Create the method called `name`, an object of its family with these options.

    Raises SceneError for an option that the method does not have.
    """
    family = _family(require_word("method", name, "a name such as dop853"))
    unknown = sorted(options.keys() - _option_names(family))
    if unknown:
        owners = [x for x in (*IMPLICIT, *_CLASSICAL) if unknown[0] in _option_names(_family(x))]
        remedy = f"methods with it: {', '.join(owners)}" if owners else "no method has it"
        raise SceneError(f'{unknown[0]}: method "{name or "auto"}" has no such option; {remedy}')
    return family(name, **options)


def to_method(given: str | Method) -> Method:
    """Method from an object or a name.  SceneError for other types."""
    if isinstance(given, Method):
        require_word("method", given.name, "a name such as dop853")
        return given
    return method(require_word("method", given, "a name such as dop853, or one of mstmm.methods"))


def _option_names(family: type[Method]) -> set[str]:
    return {f.name for f in fields(family)}


def _family(name: str) -> type[Method]:
    if name in _CLASSICAL:
        return ClassicalDiscreteTime
    if name in METHODS_WITH_RADIUS:
        return GeneralizedAlpha
    return Implicit if name in IMPLICIT else Method
