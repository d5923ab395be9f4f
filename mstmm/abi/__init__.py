"""Interface between Python and C: names, signatures and layouts of compiled code."""
