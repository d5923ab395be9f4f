"""What a user asks of a compiled scene."""
