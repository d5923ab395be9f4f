"""Failure atlas: parameter values at which numerical methods fail, and remedies."""
