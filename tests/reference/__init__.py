"""Independent formulations that the engine is compared with.

Nothing here imports mstmm: a scene is a plain dictionary in the shape of the scene file.
"""
