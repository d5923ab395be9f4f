"""The graph of a mechanism: which hinges make its tree, and where its loops close.

Pure: bodies and hinges are numbers here, -1 is the ground.
"""
