"""Commands that display a run: animations, plots and reports."""
