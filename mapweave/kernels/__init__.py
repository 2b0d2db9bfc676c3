"""The inner loops: each compiled, with a NumPy twin that is its oracle and its fallback.

Arrays in, arrays out; but the coder of numbers, whose twin is plain Python, takes one at a time.
What calls a kernel does not know which of the two it got.
"""
