"""The live page and the JSON behind it: what the coordinator knows, for people and programs.

`feed` and `address` cost nothing to import; the rest needs Starlette and uvicorn, the optional
extra ``web``, and is imported only where a page is asked for.
"""
