"""The public face of scenes: the tables that a scene is built from, and how one is read."""

from __future__ import annotations

from .scene_beam import Beam
from .scene_beam_keys import Modes, Section, Shapes
from .scene_body import Body, End
from .scene_chain import Chain
from .scene_class import Scene
from .scene_elastic import Elastic
from .scene_elastic_keys import Arrays, Box, ElasticEnd
from .scene_file import read
from .scene_flexible import Damping, Start
from .scene_hinge_keys import Initial
from .scene_hinge_table import Hinge
from .scene_law import Friction, Law, LawEntry, Limits, SpringLaw
from .scene_load import load_scene
from .scene_parts import Event, Load, Spring
from .scene_rules import split

__all__ = [
    "Arrays", "Beam", "Body", "Box", "Chain", "Damping", "Elastic", "ElasticEnd", "End", "Event",
    "Friction", "Hinge", "Initial", "Law", "LawEntry", "Limits", "Load", "Modes", "Scene",
    "Section", "Shapes", "Spring", "SpringLaw", "Start", "load_scene", "read", "split",
]  # fmt: skip
