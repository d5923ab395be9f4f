"""Cases of closed loops."""
