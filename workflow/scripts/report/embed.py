"""Files within the page: compressed, as text, and unpacked by the reader's browser when they are asked for."""

import base64
import gzip
import json


def packed(content):
    """A file's content (bytes, or text) as it stands in the page: base64 of its gzip, the same every time."""
    content = content.encode() if isinstance(content, str) else content
    return base64.b64encode(gzip.compress(content, compresslevel=9, mtime=0)).decode()


def packed_json(data):
    """What the page's scripts read, likewise."""
    return packed(json.dumps(data, separators=(",", ":"), allow_nan=False))
