"""What is compiled, kept for the next job."""

import os
import tempfile
from pathlib import Path

import jax


def keep_compiled():
    """Let the next job load what JAX compiles in this one: seconds of a job's start. Returns the device."""
    if folder():
        jax.config.update("jax_compilation_cache_dir", folder())
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.1)
    return jax.devices()[0].device_kind


def folder():
    """Where it is kept, '' if that is not one's own: for this machine's processor and so many threads."""
    # Kept on this machine, where nobody else may write.
    path = Path(tempfile.gettempdir()) / f"isarflow-{os.getuid()}-compiled-{os.environ.get('NPROC', 'all')}"
    path.mkdir(mode=0o700, exist_ok=True)
    return str(path) if path.stat().st_uid == os.getuid() else ""
