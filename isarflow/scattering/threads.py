"""Threads that each call a BLAS of one thread.

The last bit of a product depends on how many threads BLAS splits it between, and results must not.
"""

from concurrent.futures import ThreadPoolExecutor
from functools import cache
from threading import Lock

import threadpoolctl


class _OneThread:
    """A context in which the process's BLAS has one thread: the first that enters limits it, the last restores it."""

    def __init__(self):
        self.lock, self.users, self.limit = Lock(), 0, None

    def __enter__(self):
        with self.lock:
            if self.users == 0:
                _take_control()
                self.limit = _libraries().limit(limits=1, user_api="blas")
            self.users += 1

    def __exit__(self, *error):
        with self.lock:
            self.users -= 1
            if self.users == 0:
                _take_control()
                self.limit.restore_original_limits()
                _take_control()  # leaves it to the next that asks


def _take_control():
    """Let any thread set OpenBLAS's threads next: threadpoolctl else ignores all but the one that was the first."""
    threadpoolctl.OpenBLASController.clear_controlling_thread(force=True)


@cache
def _libraries():
    return threadpoolctl.ThreadpoolController()  # to find the loaded libraries takes milliseconds


blas_of_one_thread = _OneThread()  # one for all, as BLAS is


class Pool(ThreadPoolExecutor):
    """Threads that each call a BLAS of one thread."""

    def __enter__(self):
        blas_of_one_thread.__enter__()
        return super().__enter__()

    def __exit__(self, *error):
        super().__exit__(*error)
        blas_of_one_thread.__exit__()

    @staticmethod
    def wait(futures):
        for future in futures:
            future.result()
