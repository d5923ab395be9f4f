"""Runs of a scene, and experiments of many runs: error control, chart, model reduction."""
