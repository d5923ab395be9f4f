"""Starts at rest: shapes of flexible bodies, and mechanisms on their way there."""
