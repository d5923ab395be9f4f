"""When the expressions of a scene switch or are narrow, by interval arithmetic over time."""
