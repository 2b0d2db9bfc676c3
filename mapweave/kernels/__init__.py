"""The inner loops: each compiled, with a NumPy twin that is its oracle and its fallback.

Arrays in, arrays out. What calls a kernel does not know which of the two it got.
"""
