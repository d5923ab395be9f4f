"""One-way elastodynamics: rigid motion first, then the linear response to it."""
