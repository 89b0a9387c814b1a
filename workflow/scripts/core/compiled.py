"""What JAX compiles, kept for the next job."""

import os
import tempfile
from pathlib import Path

import jax


def keep_compiled():
    """Let the next job load what this one compiles: seconds of a job's start. Returns the device."""
    # Compiled for this machine's processor and so many threads, so kept on this machine, where nobody else may write.
    folder = Path(tempfile.gettempdir()) / f"isarflow-{os.getuid()}-compiled-{os.environ.get('NPROC', 'all')}"
    folder.mkdir(mode=0o700, exist_ok=True)
    if folder.stat().st_uid == os.getuid():
        jax.config.update("jax_compilation_cache_dir", str(folder))
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.1)
    return jax.devices()[0].device_kind
