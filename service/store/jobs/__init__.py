"""Jobs: submitted, attempted by workers, read by clients, decided about by people. All SQL about them.

The row is the one truth about a job. The engine of the queue only decides when a worker looks at it; whether there is
still something to do is decided here. Moments are the database's: the clocks of several machines differ.
"""
