"""Tree of the links of a robot: inboard joints, roots, and joints without outboard mass."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator

from ...errors import SceneError
from ..validators.validation_messages import did_you_mean
from .robot_model import FIXED, ZERO_MATRIX, Joint, Link, Robot


class LinkTree:
    """Tree of the links of a robot.

    `links` and `joints` are by name; `holder` is the inboard joint of a link, `outboard_joints` the
    outboard joints of a link; `roots` are the links without an inboard joint.
    """

    def __init__(self, robot: Robot) -> None:
        self.links: dict[str, Link] = {}
        for link in robot.links:
            _check_unique(self.links, link, "link")
            self.links[link.name] = link
        self.joints: dict[str, Joint] = {}
        self.holder: dict[str, Joint] = {}
        self.outboard_joints: defaultdict[str, list[Joint]] = defaultdict(list)
        for joint in robot.joints:
            _check_unique(self.joints, joint, "joint")
            self.joints[joint.name] = joint
            self._hang(joint)
        if not self.links:
            raise SceneError(f"{robot.where}: the robot has no link")
        self.roots = [name for name in self.links if name not in self.holder]
        self.outward = list(self._outward())
        if len(self.outward) < len(self.links):
            reached_names = {link.name for link in self.outward}
            name = next(name for name in self.links if name not in reached_names)
            raise SceneError(
                f"{self.holder[name].where}: the joints around link {name!r} form a cycle, which "
                "URDF does not allow; remove one of them, and close the loop in the scene"
            )

    def _hang(self, joint: Joint) -> None:
        for end in (joint.parent, joint.child):
            if end not in self.links:
                raise SceneError(
                    f"{joint.where}: joint {joint.name!r}: there is no link {end!r}"
                    + did_you_mean(end, self.links)
                )
        if joint.child in self.holder:
            raise SceneError(
                f"{joint.where}: link {joint.child!r} is the child of joint "
                f"{self.holder[joint.child].name!r} and of {joint.name!r}; a link has one parent"
            )
        self.holder[joint.child] = joint
        self.outboard_joints[joint.parent].append(joint)

    def _outward(self) -> Iterator[Link]:
        """Links in tree order, each after its parent."""
        stack = list(reversed(self.roots))
        while stack:
            name = stack.pop()
            yield self.links[name]
            stack += [joint.child for joint in reversed(self.outboard_joints[name])]

    def weightless(self) -> list[Joint]:
        """Moving joints without any mass or inertia outboard of them."""
        heavy_links = set[str]()
        for link in reversed(self.outward):
            has_heavy_child = any(
                joint.child in heavy_links for joint in self.outboard_joints[link.name]
            )
            if has_heavy_child or link.mass > 0 or link.inertia != ZERO_MATRIX:
                heavy_links.add(link.name)
        return [
            joint for joint in self.joints.values()
            if joint.type != FIXED and joint.child not in heavy_links
        ]  # fmt: skip


def _check_unique(known: Collection[str], one: Link | Joint, what: str) -> None:
    if one.name in known:
        raise SceneError(f"{one.where}: {what} {one.name!r} is defined twice; rename one of them")
