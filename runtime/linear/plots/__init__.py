"""Pictures of linear models: their matrices, motions and answers (extra: plot)."""
