"""What runs jobs: this process, or Dask."""
