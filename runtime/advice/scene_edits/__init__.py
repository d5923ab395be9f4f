"""Scenes written otherwise: chains as bodies of their own, welded bodies as one, other names."""
