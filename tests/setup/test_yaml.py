"""Config files that YAML readers pass over in silence, or choke on."""

import os

import pytest

from isarflow.core.errors import InputError
from isarflow.setup.config import load_config
from isarflow.setup.yaml_file import check_command_line, read_yaml


def test_key_that_stands_twice_is_refused(tmp_path):
    file = tmp_path / "twice.yaml"
    file.write_text("radar: {bandwidth: 1}\nname: a\nradar: {bandwidth: 2}\n")
    with pytest.raises(InputError, match=r"twice.yaml, line 3, column 1: the key 'radar' stands twice"):
        load_config(read_yaml(file))


SLIPS = {
    "a bracket left open": (
        b"name: a\nradar: [1, 2\n",
        "line 3, column 1: while parsing a flow sequence that begins in line 2, column 8: did not find expected ','",
    ),
    "a brace left open": (
        b"name: {a\n",
        "line 2, column 1: while parsing a flow mapping that begins in line 1, column 7: did not find expected ','",
    ),
    "no comma": (
        b"t: {mesh: a.stl role: b}\n",
        "line 1, column 21: while parsing a flow mapping that begins in line 1, column 4",
    ),
    "two commas": (b"a: [1,,2]\n", "line 1, column 7: "),
    "one brace too many": (b"a: {b: 1}}\n", "line 1, column 10: while parsing a block mapping"),
    "tabs that indent": (b"radar:\n\tbandwidth: 1\n", "line 2, column 1: while scanning for the next token"),
    "a tab before a value": (
        b"noise: \t{per: image}\n",
        "line 1, column 8: found character '\\t' that cannot start any token",
    ),
    "a tab among spaces": (b"radar: \n  a: 1\n\tb: 2\n", "line 3, column 1: while scanning a plain scalar"),
    "two colons": (
        b"name: a: b\n",
        "line 1, column 8: mapping values are not allowed in this context. Look at the brackets",
    ),
    "no space after the colon": (
        b"name:a\nseed: 1\n",
        "line 2, column 5: mapping values are not allowed in this context",
    ),
    "no colon": (b"name: a\nseed\n", "line 2, column 1: could not find expected ':'"),
    "crooked lines": (
        b"a:\n  b: 1\n c: 2\n",
        "line 3, column 2: while parsing a block mapping that begins in line 1, column 1",
    ),
    "not an item": (b"a:\n - b\n c: 1\n", "line 3, column 2: "),
    "Latin-1": (b"seed: 1\nname: caf\xe9\n", "line 2: not text in UTF-8 (byte 0xe9); save the file as UTF-8"),
    "UTF-16": ("name: a".encode("utf-16"), "line 1: not text in UTF-8 (byte 0xff)"),
    "a list for a key": (b"name: a\n[a, b]: 1\n", "line 2, column 1: a key must be a word"),
    "two of a key": (b"name: a\nname: b\n", "line 2, column 1: the key 'name' stands twice"),
    "two of a key in JSON": (b'{"name": "a",\n"name": "b"}', "line 2, column 1: the key 'name' stands twice"),
    "no such day": (b"seed: 2020-13-45\n", ": month"),
    "two documents": (b"name: a\n---\nname: b\n", "line 1, column 1: but found another document"),
    "an end in the middle": (b"name: a\n...\nname: b\n", "line 3, column 1: "),
    "a zero byte": (b"name: a\0\n", ": control characters are not allowed"),
    "JSON without end": (b'{"a": ' + b"[" * 3000 + b"]" * 3000 + b"}", "more than a thousand deep"),
    "a bracket at the end": (b"a: [[1", "while parsing a flow sequence that begins in line 1, column 5"),
    "a brace and nothing": (b"name: {", "line 2, column 1: "),
    "an alias to itself": (
        b"radar: &a\n  b: *a\n",
        "line 1, column 8: found unconstructable recursive node",
    ),
    "an alias to nothing": (b"name: *b\n", "line 1, column 7: "),
    "brackets without end": (b"a: " + b"[" * 3000 + b"]" * 3000, "stand in one another more than a thousand deep"),
    "an open quote": (
        b"name: 'a\nseed: 1\n",
        "column 1: while scanning a quoted scalar that begins in line 1, column 7: found unexpected end",
    ),
    "a Windows path": (b'mesh: "C:\\Users\\x.stl"\n', "line 1, column 12: while parsing a quoted scalar"),
    "another escape": (
        b'mesh: "C:\\cad\\x.stl"\n',
        "line 1, column 10: while parsing a quoted scalar that begins in line 1, column 7: found unknown escape",
    ),
    "an at sign": (b"name: @x\n", "line 1, column 7: while scanning for the next token"),
    "a star": (b"name: *\n", "line 1, column 8: "),
    "text after a bar": (b"name: |x\n", "line 1, column 8: "),
    "a tag": (b"a: !!python/object:os.system x\n", "line 1, column 4: "),
    "a merge of nothing": (b"a: {<<: 5}\n", "line 1, column 9: "),
    "nothing": (b"", " is empty"),
    "comments alone": (b"# name: a\n", " is empty"),
    "a list": (b"- a\n", " holds a list"),
    "a word": (b"hello\n", " holds 'hello' alone"),
}


@pytest.mark.parametrize("slip", SLIPS)
def test_slip_is_refused_with_its_place(slip, tmp_path):
    text, hint = SLIPS[slip]
    file = tmp_path / "bad.yaml"
    file.write_bytes(text)
    with pytest.raises(InputError) as caught:
        read_yaml(file)
    message = str(caught.value)
    assert message.startswith(str(file)) and hint in message
    assert "\n" not in message and message.endswith(".")


def test_json_is_read_tabs_and_all(tmp_path):
    file = tmp_path / "mine.json"
    file.write_text('{\n\t"name": "mine",\n\t"noise": {"snr_db": [1, 2.5]}\n}')
    assert read_yaml(file) == {"name": "mine", "noise": {"snr_db": [1, 2.5]}}


def test_missing_file_and_folder(tmp_path):
    for path, problem in (("a.yaml", "there is no such config file"), (".", "Is a directory"), ("b.yaml/c", "no such")):
        with pytest.raises(InputError, match=problem):
            read_yaml(tmp_path / path)
    with pytest.raises(InputError, match="If 'report' is what to make, it stands before --configfile"):
        read_yaml("report")


def test_pipe_is_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="reads a config more than once"):
        read_yaml(tmp_path / "pipe")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--config", "radar.bandwidth=1e8"], "with a key of the config's first level"),
        (["--config", "seed"], "write key=value"),
        (["--config", "name=a", "=3"], "--config =3: write key=value"),
        (
            ["-C", "noise={snr_db:", "[1,2]}"],
            "--config [1,2]}: write key=value",
        ),
    ],
)
def test_settings_of_the_command_line_are_held_to_their_form(arguments, message):
    with pytest.raises(SystemExit) as end:
        check_command_line(["report", *arguments], "/home/me/isarflow")
    assert message in str(end.value)


def test_settings_of_the_command_line_that_are_right():
    check_command_line(["--config", "name=b", "noise={snr_db: [1, 2]}", "--cores", "2"], "/home/me/isarflow")
    with pytest.raises(SystemExit, match="Snakemake takes braces in a path for wildcards"):
        check_command_line([], "/home/me/{isarflow}")
