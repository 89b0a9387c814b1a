"""Which code is running: its commit. Its version is `isarflow.__version__`."""

import subprocess

from isarflow.core.folders import ROOT


def commit():
    """Return the commit of the code, with '-dirty' where files were changed since; 'unknown' outside a git checkout."""
    describe = ["git", "describe", "--always", "--dirty"]
    try:
        return subprocess.run(describe, cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
