"""Config files that YAML readers pass over in silence, or choke on."""

import pytest

from common.config import load, read_yaml
from common.errors import InputError


def test_key_that_stands_twice_is_refused(tmp_path):
    file = tmp_path / "twice.yaml"
    file.write_text("radar: {bandwidth: 1}\nname: a\nradar: {bandwidth: 2}\n")
    with pytest.raises(InputError, match=r"twice.yaml, line 3: the key 'radar' stands twice"):
        load({}, [file])


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        (b"name: a\nradar: [1, 2\n", "bad.yaml, line 3"),
        (b"radar:\n\tbandwidth: 1\n", "line 2: found character that cannot start any token; YAML is indented with"),
        (b"name: a: b\n", "bad.yaml, line 1"),
        (b"name: caf\xe9\n", "bad.yaml, byte 10: not a text file in UTF-8"),
        (b"name: a\n[a, b]: 1\n", "line 2: a key must be a word"),
        (b"seed: 2020-13-45\n", "bad.yaml: month"),
        (b"name: a\n---\nname: b\n", "bad.yaml, line 2"),
        (b"name: a\0\n", "bad.yaml: unacceptable character"),
    ],
)
def test_bad_syntax_is_refused_with_its_place(text, hint, tmp_path):
    file = tmp_path / "bad.yaml"
    file.write_bytes(text)
    with pytest.raises(InputError) as caught:
        read_yaml(file)
    assert hint in str(caught.value)
    assert "\n" not in str(caught.value)
