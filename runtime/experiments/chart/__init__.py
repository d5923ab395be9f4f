"""Work-precision chart of a scene: all methods and model levels, and which setting to use."""
