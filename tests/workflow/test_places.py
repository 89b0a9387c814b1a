"""Where a repository, its environment and a user's folder may lie: in paths with spaces, and apart from each other."""

import shutil
import sys
from pathlib import Path

CONFIG = """
name: places
targets: {'*': null, corner: {mesh: resources/cad/trihedral.stl, role: other, symmetry: [xz]}}
mesh: {bands: 1}
radar: {center_frequency: 0.5e9, bandwidth: 0, frequencies: 1, polarizations: [VV]}
aspect: {elevation: {start: 0, stop: 0, step: 1}, azimuth: {count: 4}}
"""


def test_repository_and_environment_in_paths_with_spaces(project_of, tmp_path):
    project = project_of("my project (2)")
    project.write("config/places.yaml", CONFIG)
    environment = tmp_path / "my tools"
    environment.symlink_to(Path(sys.executable).parents[1], target_is_directory=True)
    python = environment / "bin" / Path(sys.executable).name
    made = "results/places/mesh/corner.json"
    finished = project.run("--cores", 1, made, "--configfile", "config/places.yaml", python=python)
    assert finished.returncode == 0, finished.stdout
    assert (project.folder / made).exists()


def test_run_from_a_folder_of_ones_own(project_of, tmp_path):
    """Targets of the repository and of one's own; the results lie in one's own folder alone."""
    project = project_of("repository")
    (tmp_path / "cad").mkdir()
    shutil.copy(project.folder / "resources/cad/trihedral.stl", tmp_path / "cad/mine.stl")
    mine = "targets: {mine: {mesh: cad/mine.stl, role: other}, "
    (tmp_path / "places.yaml").write_text(CONFIG.replace("targets: {", mine))
    made = [f"results/places/mesh/{name}.json" for name in ("corner", "mine")]
    start = ("--cores", 1, "-s", project.folder / "Snakefile")
    finished = project.run(*start, *made, "--configfile", "places.yaml", cwd=tmp_path)
    assert finished.returncode == 0, finished.stdout
    assert all((tmp_path / path).exists() for path in made) and not (project.folder / "results").exists()
    finished = project.run(*start, *made, "--configfile", "places.yaml", "--dry-run", cwd=tmp_path)
    assert "Nothing to be done" in finished.stdout
    # The default experiment, and what its page compares with, are found too.
    finished = project.run(*start, "--dry-run", "report", cwd=tmp_path)
    assert finished.returncode == 0, finished.stdout
