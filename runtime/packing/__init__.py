"""A scene becomes the arrays of the looped engine, in internal frames."""
