"""One task, done in whatever process: here, in a worker of this machine, on a cluster."""
