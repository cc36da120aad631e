"""Routes that submit jobs, one module for each kind of job."""
