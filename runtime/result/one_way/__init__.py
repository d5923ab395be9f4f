"""One-way elastodynamics: rigid motion first, then the linear elastic response."""
