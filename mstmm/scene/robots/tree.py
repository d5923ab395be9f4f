"""The tree of a robot's links: who holds whom, and what hangs on nothing that has mass."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator

from ...errors import SceneError
from ..rules.messages import near
from .robot import FIXED, NOTHING, Joint, Link, Robot


class Tree:
    """`links` and `joints` by name, `holder` the joint that holds a link, `carried` by link the
    joints that hang on it, `roots` the links that nothing holds."""

    def __init__(self, robot: Robot) -> None:
        self.links: dict[str, Link] = {}
        for link in robot.links:
            _once(self.links, link, "link")
            self.links[link.name] = link
        self.joints: dict[str, Joint] = {}
        self.holder: dict[str, Joint] = {}
        self.carried: defaultdict[str, list[Joint]] = defaultdict(list)
        for joint in robot.joints:
            _once(self.joints, joint, "joint")
            self.joints[joint.name] = joint
            self._hang(joint)
        if not self.links:
            raise SceneError(f"{robot.where}: there is no link in it")
        self.roots = [name for name in self.links if name not in self.holder]
        self.outward = list(self._outward())
        if len(self.outward) < len(self.links):
            reached = {link.name for link in self.outward}
            name = next(name for name in self.links if name not in reached)
            raise SceneError(
                f"{self.holder[name].where}: the joints around link {name!r} close a ring, which "
                "URDF has not; take one of them out, and close the loop in the scene"
            )

    def _hang(self, joint: Joint) -> None:
        for end in (joint.parent, joint.child):
            if end not in self.links:
                raise SceneError(
                    f"{joint.where}: joint {joint.name!r}: there is no link {end!r}"
                    + near(end, self.links)
                )
        if joint.child in self.holder:
            raise SceneError(
                f"{joint.where}: link {joint.child!r} is held by joint "
                f"{self.holder[joint.child].name!r} and by {joint.name!r}; a link has one parent"
            )
        self.holder[joint.child] = joint
        self.carried[joint.parent].append(joint)

    def _outward(self) -> Iterator[Link]:
        """Links, each behind the one that holds it."""
        left = list(reversed(self.roots))
        while left:
            name = left.pop()
            yield self.links[name]
            left += [joint.child for joint in reversed(self.carried[name])]

    def weightless(self) -> list[Joint]:
        """Joints that move, and nothing that has mass or inertia."""
        heavy = set[str]()
        for link in reversed(self.outward):
            below = any(joint.child in heavy for joint in self.carried[link.name])
            if below or link.mass > 0 or link.inertia != NOTHING:
                heavy.add(link.name)
        return [
            joint for joint in self.joints.values()
            if joint.type != FIXED and joint.child not in heavy
        ]  # fmt: skip


def _once(known: Collection[str], one: Link | Joint, what: str) -> None:
    if one.name in known:
        raise SceneError(f"{one.where}: {what} {one.name!r} is there twice; name one of them anew")
