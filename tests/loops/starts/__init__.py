"""Where closed loops begin: assembly, and wishes that cannot be met."""
