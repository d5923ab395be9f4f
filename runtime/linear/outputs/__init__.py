"""Outputs of linear models as rows of their coordinates."""
