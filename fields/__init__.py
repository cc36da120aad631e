"""Fields of play as data: a file per sport, and what reads them. Knows no camera, no venue and no picture.

Both the service (which templates there are, what points are called) and the engine (where the paint is) look here.
"""
