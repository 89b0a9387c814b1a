"""The frame of every job script around its one function: log file, threads, readable errors."""

import contextlib
import errno
import os
import signal
import subprocess
import sys
import time
import traceback

import threadpoolctl

from isarflow.core.errors import InputError

SECONDS = 30  # between a progress bar's lines in a log
SPACE = "Make room there and run the same command: it goes on with what is missing."
ACCESS = "Make it readable and writable for you and run the same command: it goes on with what is missing."
# A separate process that outlives the job: it reads until the job ends. A job that ended without a message was
# killed. Run without site packages (-I -S), it starts in a hundredth of a second.
WATCH = """
import sys
if not sys.stdin.buffer.read():
    with open(sys.argv[1], "a") as log:
        print(sys.argv[2], file=log)
"""
KILLED = (
    "Error: this job was killed (a signal ended it before it could say anything). Unless somebody stopped it, the "
    "usual reason is that the machine ran out of memory: close what else uses it, or run one job at a time "
    "(--cores 1). The same command goes on from here; docs/troubleshooting.md has more."
)
REFUSED = {errno.ENOSPC: SPACE, errno.EDQUOT: SPACE, errno.EROFS: ACCESS, errno.EACCES: ACCESS, errno.EPERM: ACCESS}


class _Tee:
    """A stream that writes to the terminal and to the log file.

    A progress bar redraws its line: where that does not work, it prints a new line from time to time.
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
        """Do nothing: the stream belongs to the job. Loggers that kept it close it when Python ends."""

    def isatty(self):
        return self.redraws


@contextlib.contextmanager
def job(snakemake):
    """Run the body with its output in `snakemake.log[0]` and BLAS on one thread.

    The last bit of a product depends on how many threads BLAS splits it between, and the results must not.
    An InputError, a full disk or a file that may not be written ends the job with one message, Ctrl-C without one;
    anything else with a traceback in the log. If a job is killed, another process writes that to the log.
    """
    out, err, message = sys.stdout, sys.stderr, None
    try:
        with open(snakemake.log[0], "w") as log, _watched(snakemake.log[0]), threadpoolctl.threadpool_limits(1):
            sys.stdout, sys.stderr = _Tee(out, log), _Tee(err, log)
            yield
    except InputError as error:
        message = f"Error: {error}"
    except KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # a second Ctrl-C would interrupt the libraries' own cleaning up
        sys.exit(128 + signal.SIGINT)  # Snakemake itself says that it was stopped
    except Exception as error:
        message = _refused(error, snakemake.output[0]) or traceback.format_exc()
    finally:
        sys.stdout, sys.stderr = out, err
    if message:
        _report(message, snakemake.log[0])
        sys.exit(1)


@contextlib.contextmanager
def _watched(log):
    """Run the body while another process waits to write KILLED into the log if this one ends within the body."""
    watch = subprocess.Popen(
        [sys.executable, "-I", "-S", "-c", WATCH, log, KILLED],
        stdin=subprocess.PIPE,
        start_new_session=True,  # not killed along with the job's group
    )
    try:
        yield
    finally:
        watch.communicate(b"ended")


def _refused(error, output):
    """The message for an error that comes from a file that the system refused; None for other errors."""
    while error is not None:
        if isinstance(error, OSError) and error.errno in REFUSED:
            # An error from writing to an open file does not have its name.
            return f"Error: {error.filename or output}: {error.strerror}. {REFUSED[error.errno]}"
        error = error.__cause__


def _report(message, log):
    """Write to the log alone, which Snakemake shows of a failed job; to the terminal if the log cannot be written."""
    try:
        with open(log, "a") as file:
            print(message, file=file)
    except OSError:
        print(message, file=sys.stderr)
