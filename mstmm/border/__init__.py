"""What Python and C agree on: names, signatures and layouts of compiled code."""
