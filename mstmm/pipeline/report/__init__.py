"""Self-contained HTML report of a run: quality report, motion, curves and equations."""
