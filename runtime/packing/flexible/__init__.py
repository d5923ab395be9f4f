"""Flexible bodies become nodes, or rigid bodies, of the scene that the sweep visits."""
