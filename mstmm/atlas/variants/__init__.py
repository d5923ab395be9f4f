"""Methods that are known to fail, built from the kernels of the good ones.

Only cases of the atlas use them, never a run.
"""
