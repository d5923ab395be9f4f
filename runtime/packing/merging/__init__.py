"""Several bodies as one."""
