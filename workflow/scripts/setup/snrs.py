"""Write out the SNRs of a config: ranges as their values, `all` as every SNR that the config has."""

import numpy as np

from isarflow.core import sweep
from isarflow.core.errors import InputError
from isarflow.learning.experiments import CLEAN
from isarflow.setup.schema import repeated

MOST = 201  # SNRs in a list
ALL = "all"


def write_out(config):
    """Replace the ranges and `all` of a config that keeps to the schema by lists of SNRs in dB, in place."""
    noise = config["noise"]
    noise["snr_db"] = _listed("noise.snr_db", noise["snr_db"], ())
    every = [CLEAN, *sorted(noise["snr_db"])]
    for name, experiment in config["learning"]["experiments"].items():
        key, train = f"learning.experiments.{name}.train.snr_db", experiment["train"]
        snrs = train["snr_db"]
        if isinstance(snrs, dict) and "step" not in snrs:
            snrs = {way: _listed(f"{key}.{way}", inner, every) for way, inner in snrs.items()}
        elif isinstance(snrs, dict | list) or snrs == ALL:
            snrs = _listed(key, snrs, every)
        experiment["train"] = train | {"snr_db": snrs}


def _listed(key, snrs, every):
    """The list of SNRs that a range, a list with ranges in it, or `all` means."""
    if snrs == ALL:
        return list(every)
    listed = []
    for snr in snrs if isinstance(snrs, list) else [snrs]:
        listed += _steps(key, **snr) if isinstance(snr, dict) else [snr]
    twice = repeated(listed)
    if twice is not None:
        raise InputError(f"config key '{key}': {twice} stands twice in it.")
    if len(listed) > MOST:
        raise InputError(f"config key '{key}' has more than {MOST} entries.")
    return listed


def _steps(key, start, stop, step):
    if start > stop:
        raise InputError(f"config key '{key}': start {start} to stop {stop} must ascend.")
    if (stop - start) / step > MOST:
        raise InputError(f"config key '{key}': steps of {step:g} dB make more than {MOST} entries.")
    # As people write them: 0.3, where 3 * 0.1 is not; and whole numbers without a point.
    rounded = [round(float(value), 9) for value in stepped(key, start, stop, step, "dB")]
    return [int(value) if value.is_integer() else value for value in rounded]


def stepped(key, start, stop, step, unit):
    """The values of a range of the config. Raises InputError if its steps miss its stop."""
    values = sweep.stepped(start, stop, step)
    if not np.isclose(values[-1], stop):
        raise InputError(
            f"config key '{key}': steps of {step} {unit} from {start} do not end at stop {stop}, but at {values[-1]:g}."
        )
    return values
