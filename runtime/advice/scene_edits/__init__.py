"""Edits of a scene: expand chains, merge welded bodies, rename references."""
