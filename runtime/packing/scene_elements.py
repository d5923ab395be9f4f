"""Elements that a scene uses: prebuilt and user-defined ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from mstmm.errors import SceneError
from mstmm.ir.hinge_properties import Param
from mstmm.ir.scene_structure import Key
from mstmm.scene import Hinge

from ..kernels import prebuilt_kernels
from ..kernels.prebuilt_kernels import Element

Known = Mapping[Key, Element]

#: Type that runs a weld which may be released; its speeds are prescribed until then.
LETS_GO = "free"


def kernel_type(hinge: Hinge, releases: Mapping[str, int]) -> str:
    """Name of the element whose kernels compute the motion of a hinge."""
    if hinge.is_weld and hinge.name in releases:
        return LETS_GO
    return hinge.type if hinge.facts is None else hinge.facts.runs_as


class Elements:
    """Prebuilt and user-defined elements, by kind and name."""

    def __init__(self, known: Known) -> None:
        self.known = known

    def __getitem__(self, key: Key) -> Element:
        """Element with this key; KeyError if it is not defined."""
        return self.known[key] if key in self.known else prebuilt_kernels.elements()[key]

    def __contains__(self, key: Key) -> bool:
        return key in self.known or key in prebuilt_kernels.elements()

    def get(self, kind: str, name: str, user: str) -> Element:
        """Element that the part `user` names as its type; SceneError if it is not defined."""
        try:
            return self[kind, name]
        except KeyError:
            raise SceneError(
                f'scene: {kind} "{user}": type: unknown type "{name}"; generate it with: '
                "mstmm generate FILE, or use one of: mstmm list"
            ) from None


def declared_numbers(
    declared: Sequence[Param], given: Mapping[str, float], where: str
) -> tuple[float, ...]:
    """Values of declared parameters in their order, with defaults.

    Raises SceneError with the name of the element (`where`) for missing or invalid values.
    """
    numbers = []
    for p in declared:
        value = given.get(p.name, p.default)
        problem = ""
        if value is None:
            problem = "missing; expected a number"
        elif p.minimum is not None and value < p.minimum:
            problem = f"expected {p.minimum:g} {p.unit} or more, found {value:g}"
        elif p.maximum is not None and value > p.maximum:
            problem = f"expected {p.maximum:g} {p.unit} or less, found {value:g}"
        if value is None or problem:
            raise SceneError(f"scene: {where}: parameters.{p.name}: {problem}")
        numbers.append(value)
    return tuple(numbers)
