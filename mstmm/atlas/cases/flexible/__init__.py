"""Models of flexible bodies."""
