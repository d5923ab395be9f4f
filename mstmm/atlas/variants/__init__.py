"""Methods that are known to be bad, made of the same kernels as the good ones.

Only cases of the atlas reach them; a run never does.
"""
