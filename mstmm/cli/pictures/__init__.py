"""Commands that show a run: pages, strips and films, curves, a report."""
