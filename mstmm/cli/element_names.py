"""Resolution of the name of an element to its kind and name."""

from __future__ import annotations

from mstmm.errors import ElementError

KINDS = ("hinge", "body", "force", "classical", "sweep")


def element_index() -> dict[str, tuple[str, str]]:
    """Index of built-in and stored elements: full name (hinge_pin) -> (kind, name)."""
    from mstmm.runtime.kernels import kernel_store

    from . import stored_elements

    built_in = [(e.kind, e.name) for kind in KINDS for e in stored_elements.builtin_entries(kind)]
    names = {
        f"{kind}_{name}": (kind, name)
        for kind, name in [*built_in, *sorted(kernel_store.all_specs())]
    }
    return names | {"hinge_elastic": ("hinge", "free")}  # same motion; its law is in sweep_laws


def find_element(name: str) -> tuple[str, str]:
    """Find (kind, name) of an element by its full name "hinge_pin", or by "pin".

    The short name means the first kind that has it.  Raises ElementError, with the nearest name, if
    there is no such element.
    """
    from mstmm.scene.validators.validation_messages import did_you_mean

    names = element_index()
    for full_name in (name, *(f"{kind}_{name}" for kind in KINDS)):
        if full_name in names:
            return names[full_name]
    hint = did_you_mean(name, [*names, *(short_name for _, short_name in names.values())])
    if "did you mean" not in hint:
        hint = "; mstmm list shows all elements"
    raise ElementError(f'element "{name:.60}": there is no such element{hint}')
