"""What `snakemake check` says of a CAD file, by the function that its job calls."""

import re

import numpy as np
import pytest
from test_sphere import write_ascii_stl

from isarflow.core.errors import InputError
from isarflow.setup.checkup import checkup, swept
from isarflow.setup.config import load_config, of_command_line
from isarflow.setup.overview import overview

CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
FACES = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6]])
FACES = np.concatenate([FACES, [[0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]])


def block(lengths, place=(0, 0, 0)):
    """A closed block, outward: (8, 3) and (12, 3)."""
    return (CORNERS - 0.5) * lengths + place, FACES


@pytest.fixture
def said(tmp_path, monkeypatch):
    """said(vertices, triangles, target's keys): the lines on it as one text."""
    monkeypatch.chdir(tmp_path)

    def say(vertices, triangles, **keys):
        write_ascii_stl(tmp_path / "a.stl", vertices, triangles)
        target = {"mesh": "a.stl", "role": "other", **keys}
        radar = {"frequencies": [1e9, 2e9], "polarizations": ["VV"]}
        return "\n".join(checkup(load_config({"targets": {"*": None, "a": target}, "radar": radar}), "a"))

    return say


def test_one_cad_file_is_a_config(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_ascii_stl(tmp_path / "My plate (2).stl", *block([0.3, 0.2, 0.1]))
    config = load_config(of_command_line({"cad": "My plate (2).stl"}))
    assert config["name"] == "my_plate_2" and not config["learning"]["experiments"]
    assert config["targets"] == {"my_plate_2": {"mesh": "My plate (2).stl", "role": "other"}}
    assert "size 0.3 x 0.2 x 0.1 m" in "\n".join(checkup(config, "my_plate_2"))
    assert swept(config).startswith("by 'radar' 2.025 to 3.525 GHz, by 'mesh' 10 edges")
    inches = load_config(of_command_line({"cad": "My plate (2).stl", "unit": "in"}))
    assert inches["targets"]["my_plate_2"]["unit"] == "in"
    mine = {"cad": "My plate (2).stl", "name": "mine", "targets": {"my_plate_2": "{unit: mm}"}}
    config = load_config(of_command_line(mine))
    assert config["name"] == "mine" and config["targets"]["my_plate_2"]["unit"] == "mm"


ODD_NAMES = {
    "3D_cube.stl": "cad_3d_cube",
    "747.stl": "cad_747",
    "other.stl": "cad_other",
    "OTHER.STL": "cad_other",
    "pure-noise.stl": "pure_noise",
    "Flügel é.stl": "flugel_e",
    "飛行機.stl": "cad",
    "飛 2.stl": "cad_2",
    "...stl.stl": "stl",
    "a.b-c (1).v2.stl": "a_b_c_1_v2",
    f"{'9' * 120}.stl": f"cad_{'9' * 96}",
    f"{'x' * 96} y.stl": "x" * 96,
    "none.stl": "none",
    "1e5.stl": "cad_1e5",
}


def test_a_cad_file_of_any_name_is_a_config(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_ascii_stl(tmp_path / "whole", *block([0.3, 0.2, 0.1]))
    for file, name in ODD_NAMES.items():
        (tmp_path / file).symlink_to("whole")
        config = load_config(of_command_line({"cad": file}))
        assert (config["name"], config["targets"]) == (name, {name: {"mesh": file, "role": "other"}})


def test_a_plate_is_measured(said):
    text = said(*block([300.0, 200.0, 2.0], [0, 0, 7.0]), unit="mm", symmetry=["xz"])
    assert "size 0.3 x 0.2 x 0.002 m, 12 triangles" in text
    assert "mirror planes: yz, xz; 'symmetry: [yz, xz]' would spare work" in text
    assert "surface: closed, 1 piece" in text
    assert "repairs: none needed" in text
    thick = float(text.split("thinnest part: at most ")[1].split(" mm")[0])
    assert 2 <= thick < 5
    # Of its area, 0.122 m^2 in equilateral triangles of a tenth of 0.15 m.
    unknowns = float(text.split("up to 2 GHz: about ")[1].split(" unknowns")[0].replace(",", ""))
    assert unknowns == pytest.approx(1.5 * 0.122 / (np.sqrt(3) / 4 * 0.01499**2), rel=0.01)


def test_without_a_unit_every_unit_is_tried(said):
    text = said(*block([0.3, 0.2, 0.1]))
    assert "taken as m; 0.003 x 0.002 x 0.001 m if its numbers are cm" in text
    assert "mirror planes: yz, xz, xy" in text


def test_what_would_be_repaired_and_what_is_refused_is_said(said):
    vertices, triangles = block([0.3, 0.2, 0.1])
    beside, _ = block([0.3, 0.2, 0.1], [0, 0.05, 0])
    assert "repairs: 1 " in said(vertices, np.concatenate([triangles, triangles[:1]]))
    assert "surface: open, with 0.6 m of rim" in said(vertices, triangles[2:])
    assert "refused: a.stl is not symmetric about y = 0" in said(beside, triangles, symmetry=["xz"])
    assert "refused: a.stl would be 300 m" in said(vertices * 1000, triangles)
    open_one = triangles[:-1]
    assert "refused" not in said(vertices, open_one)
    assert "refused: the mesh is open" in said(vertices, open_one, formulation="cfie")
    assert "refused" not in said(vertices, triangles, formulation="cfie")


def half_block():
    """Half of a block of 0.3 x 0.2 x 0.1 m, cut open at y = 0."""
    vertices, triangles = block([0.3, 0.1, 0.1], [0, 0.05, 0])
    return vertices, triangles[(vertices[triangles][:, :, 1] > 1e-9).any(axis=1)]


def test_a_half_model_is_described_as_the_whole_or_asked_about(said):
    text = said(*half_block(), symmetry=["xz"])
    assert "size 0.3 x 0.2 x 0.1 m, 20 triangles" in text and "surface: closed, 1 piece" in text
    assert "warning: The file has half of the target, beside the plane xz" in text
    text = said(*half_block())
    assert "size 0.3 x 0.1 x 0.1 m, 10 triangles" in text and "surface: open" in text
    assert "warning: It lies on one side of the plane xz" in text and "'symmetry: [xz]' completes it" in text


def config_of(folder, **targets):
    """A config of blocks in a folder, by name: whole, open, cracked, beside the plane xz, half. targets: their keys."""
    vertices, triangles = block([0.3, 0.2, 0.1])
    cracked = np.concatenate([vertices, vertices[:1] + np.array([0, 1e-5, 0])])
    surfaces = {
        "whole": (vertices, triangles),
        "open": (vertices, triangles[:-2]),
        "cracked": (cracked, np.concatenate([[[8, 1, 3]], triangles[1:]])),
        "beside": (block([0.3, 0.2, 0.1], [0, 0.05, 0])[0], triangles),
        "half": half_block(),
    }
    keys = {name: {"mesh": f"{name}.stl", "role": "other", "unit": "m", **own} for name, own in targets.items()}
    for name in targets:
        write_ascii_stl(folder / f"{name}.stl", *surfaces[name])
    return {"name": "a", "targets": {"*": None, **keys}, "learning": {"experiments": {"*": None}}}


@pytest.mark.parametrize(
    ("target", "own", "problem"),
    [
        ("beside", {"symmetry": ["xz"]}, r"beside.stl is not symmetric about y = 0.*leave this plane out"),
        ("open", {"formulation": "cfie"}, r"the mesh is open.*'formulation: cfie' needs closed surfaces"),
        ("open", {"material": "abs"}, r"the mesh is open.*A solid body needs closed surfaces"),
    ],
)
def test_a_target_that_its_keys_do_not_fit_is_refused_before_any_work(target, own, problem, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    config = load_config(config_of(tmp_path, whole={}, **{target: own}))
    (line,) = [line for line in overview(config, tmp_path) if line.startswith("Warning:")]
    assert re.match(f"Warning: {target}: .*{problem}", line)
    with pytest.raises(InputError, match=f"config key 'targets.{target}.mesh': .*{problem}"):
        overview(config, tmp_path, refuse=True)


def test_a_target_that_fits_its_keys_once_it_is_repaired_is_not_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    fitting = {"formulation": "cfie", "symmetry": ["xz"]}
    config = load_config(config_of(tmp_path, whole=fitting, cracked={"formulation": "cfie"}))
    assert not any("Warning" in line or "not known" in line for line in overview(config, tmp_path, refuse=True))


@pytest.mark.parametrize(
    ("own", "sentence"), [({"symmetry": ["xz"]}, "The file has half"), ({}, "It lies on one side of the plane xz")]
)
def test_a_half_model_is_warned_of_before_any_work(own, sentence, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    lines = overview(load_config(config_of(tmp_path, half=own)), tmp_path, refuse=True)
    (line,) = [line for line in lines if line.startswith("Warning:")]
    assert line.startswith(f"Warning: half: {sentence}")


def test_check_says_all_of_every_target_and_ends_in_an_error_where_one_is_refused(project_of):
    project = project_of("check")
    targets = {"beside": {"symmetry": ["xz"]}, "open": {"formulation": "cfie"}, "whole": {"symmetry": ["xy"]}}
    project.write("config/a.yaml", str(config_of(project.folder, **targets)).replace("None", "null"))
    finished = project.run("--cores", 1, "check", "--configfile", "config/a.yaml")
    assert finished.returncode != 0
    *_, last = finished.stdout.splitlines()
    assert last == "Error: refused: beside, open (results/a/check.txt says why)"
    for text in (finished.stdout, (project.folder / "results/a/check.txt").read_text()):
        assert text.count("  refused: ") == 2 and "up to 3.525 GHz: about" in text.partition("whole:")[2]
