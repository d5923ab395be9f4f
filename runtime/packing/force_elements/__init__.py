"""Massless force elements between two ends: springs, user-defined types and bushings."""
