"""Sphinx directive: the public members of a class, in the groups that it declares."""

from __future__ import annotations

import inspect
from functools import cached_property
from importlib import import_module
from typing import Any

from sphinx.util.docutils import SphinxDirective


class MemberGroups(SphinxDirective):
    """`.. member-groups:: mstmm.runtime.linear.modes.Modes`: the class, then group by group."""

    required_arguments = 1

    def run(self) -> list[Any]:
        """Nodes of the class and its members."""
        path = self.arguments[0]
        module, _, name = path.rpartition(".")
        cls = getattr(import_module(module), name)
        lines = [f".. autoclass:: {path}", "   :no-members:", "   :no-inherited-members:", ""]
        for group, members in cls.public_members().items():
            lines += ["", f".. rubric:: {group}", ""]
            for member in members:
                if (directive := _directive(cls, member)) is not None:
                    lines += [f".. {directive}:: {path}.{member}", ""]
            data = [f"``{member}``" for member in members if _directive(cls, member) is None]
            lines += ["Attributes: " + ", ".join(data), ""] if data else []
        return self.parse_text_to_nodes("\n".join(lines))


def _directive(cls: type, member: str) -> str | None:
    """Directive for a member; None for one that the class documents among its attributes."""
    found = inspect.getattr_static(cls, member, None)
    if isinstance(found, property | cached_property):
        return "autoproperty" if isinstance(found, property) else "autoattribute"
    return "automethod" if callable(found) or isinstance(found, classmethod) else None


def setup(app: Any) -> None:
    """Called by Sphinx."""
    app.add_directive("member-groups", MemberGroups)
