"""A driver to be killed: it has two workers at calls that never end. python -m tests.batch_driver"""

import os
import signal

from cocalib.batch.worker_processes import WorkerProcesses
from cocalib.platform.process import stop_on_signals
from tests.batch_calls import endless

if __name__ == "__main__":
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)  # tests may have been started in the background, where SIGINT is ignored
    stop_on_signals()
    for call, _ in WorkerProcesses(2).run_all(endless, [(0,), (1,), (2,)]):
        os.write(1, f"finished {call}\n".encode())  # one write: the workers have the same pipe
