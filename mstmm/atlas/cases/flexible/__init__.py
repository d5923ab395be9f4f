"""Cases of models of flexible bodies."""
