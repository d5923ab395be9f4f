"""Tests of scenes, expressions and the tree."""
