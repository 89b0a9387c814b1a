from isarflow.core.job import job
from isarflow.imaging.motion import Motion
from isarflow.imaging.store import make_noisy

with job(snakemake):
    settings = snakemake.params.settings
    noise = {key: settings[f"noise.{key}"] for key in ("realizations", "definition", "per")}
    noise["seed"] = settings["seed"]
    target, motion = snakemake.wildcards.target, Motion(**settings["motion"])
    make_noisy(snakemake.input.field, snakemake.output, settings["imaging"], target, noise, motion)
