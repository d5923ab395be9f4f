"""Members of public objects in groups: what `dir` shows and the reference documents."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar


class PublicMembers:
    """Base of classes whose `dir` lists only the members that users call.

    A subclass names them by group in `member_groups`; all others are for other packages of mstmm
    and may change.
    """

    member_groups: ClassVar[Mapping[str, str]]

    @classmethod
    def public_members(cls) -> dict[str, tuple[str, ...]]:
        """Names of the public members by group."""
        return {group: tuple(names.split()) for group, names in cls.member_groups.items()}

    def __dir__(self) -> list[str]:
        public = (name for names in self.public_members().values() for name in names)
        return sorted({*public, *(name for name in super().__dir__() if name.startswith("_"))})
