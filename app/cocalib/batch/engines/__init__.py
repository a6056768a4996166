"""What runs jobs: this process, worker processes, or Dask."""
