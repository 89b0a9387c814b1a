"""What every job script does around its one function: log file, threads, readable errors."""

import contextlib
import os
import sys
import time
import traceback

import threadpoolctl

from common.errors import InputError

SECONDS = 30  # between a progress bar's lines in a log


class _Tee:
    """A stream that writes to the terminal and to the log file.

    A progress bar redraws its line: where that does not work it becomes a line of its own, now and then.
    """

    def __init__(self, terminal, log):
        self.terminal, self.log, self.last = terminal, log, time.monotonic()
        self.redraws = terminal.isatty() and "ISARFLOW_QUIET" not in os.environ  # snakemake --quiet

    def write(self, text):
        redrawn = "\r" in text or "\x1b" in text
        if redrawn and self.redraws:
            self.terminal.write(text)
        if redrawn:
            line = text.replace("\x1b[A", "").strip()
            if not line or time.monotonic() - self.last < SECONDS:
                return len(text)
            self.last = time.monotonic()
            self.log.write(line + "\n")
        else:
            self.terminal.write(text)
            self.log.write(text)
        self.log.flush()
        return len(text)

    def flush(self):
        self.terminal.flush()

    def close(self):
        """Nothing: it belongs to the job. Loggers that kept the stream close it when Python ends."""

    def isatty(self):
        return self.redraws


@contextlib.contextmanager
def job(snakemake):
    """Run the body with its output in `snakemake.log[0]` and BLAS on one thread.

    The last bit of a product depends on how many threads BLAS splits it between, and the results must not.
    An InputError ends the job with its message alone; anything else with a traceback in the log.
    """
    with open(snakemake.log[0], "w") as log, threadpoolctl.threadpool_limits(1):
        out, err = sys.stdout, sys.stderr
        sys.stdout, sys.stderr = _Tee(out, log), _Tee(err, log)
        try:
            yield
        except InputError as error:
            # To the log alone: Snakemake shows the log of a job that failed.
            print(f"Error: {error}", file=log)
            sys.exit(1)
        except Exception:
            traceback.print_exc(file=log)
            sys.exit(1)
        finally:
            sys.stdout, sys.stderr = out, err
