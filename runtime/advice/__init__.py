"""The smallest sufficient model of a scene for a wanted error: estimated, tried, written down."""
