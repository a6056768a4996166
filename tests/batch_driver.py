"""A driver to be killed: it has two workers at calls that never end. python -m tests.batch_driver"""

from app.batch.engines.dask_cluster import DaskCluster
from app.signals import stop_on_signals
from tests.batch_calls import endless

if __name__ == "__main__":
    stop_on_signals()
    for number, _ in DaskCluster(workers=2).run_all(endless, [(0,), (1,), (2,)]):
        print(f"finished {number}", flush=True)
