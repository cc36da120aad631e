"""What a worker does beside its jobs: tell, tidy up, watch alarms, and begin what is due."""
