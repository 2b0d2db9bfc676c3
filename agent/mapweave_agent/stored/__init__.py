"""An agent that begins with a stored map: goes on from it, or finds itself in it."""
