"""Cases of products of transfer matrices."""
