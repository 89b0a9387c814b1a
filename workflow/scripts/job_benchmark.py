from isarflow.core.job import job
from isarflow.learning.evaluation.leaderboard import write_leaderboard

with job(snakemake):
    definition = snakemake.params.settings["noise.definition"]
    write_leaderboard(snakemake.input.scores, definition, snakemake.output.leaderboard)
