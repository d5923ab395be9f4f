"""What the pages need beyond what Sphinx has: formulas, drawings, moving views."""
