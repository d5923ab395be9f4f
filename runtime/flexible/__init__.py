"""Flexible bodies at run time: from beams and elastic bodies of a scene to numbers."""
