"""Which code is running: its version and commit."""

import subprocess
import tomllib

from isarflow.core.folders import ROOT


def version():
    """Return isarflow's version."""
    return tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]


def commit():
    """Return the commit of the code, with '-dirty' where files were changed since; 'unknown' outside a git checkout."""
    describe = ["git", "describe", "--always", "--dirty"]
    try:
        return subprocess.run(describe, cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
