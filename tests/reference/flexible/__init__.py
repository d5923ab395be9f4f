"""References for flexible bodies.

Nothing here imports mstmm: a scene is a plain dictionary in the shape of the scene file.
"""
