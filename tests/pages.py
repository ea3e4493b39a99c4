"""Pages read by the standard library's reader: whether elements close, and what they load."""

import json
import re
import zlib
from base64 import b64decode
from html.parser import HTMLParser

import numpy as np

VOID = {"br", "hr", "img", "input", "link", "meta", "path", "circle", "rect", "col"}
"""Elements without a closing tag, and those of SVG that close themselves."""


def head_of(facts):
    """The answer in the head of a report, in one text."""
    lines = ("verdict", "margin", "depends on", "not checked")
    return " ".join(text for name, text in facts if name in lines)


class Reader(HTMLParser):
    """Keeps the open elements, the addresses that they load, and the text."""

    def __init__(self, page):
        super().__init__()
        self.open, self.addresses, self.words, self.scenes, self.ids = [], [], [], [], []
        self.feed(page)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.addresses += [given[key] for key in ("src", "href", "data") if key in given]
        self.ids += [given["id"]] if "id" in given else []
        self.scripted = given.get("type") == "application/json"
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        pass

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] == "script":
            if self.scripted:
                self.scenes.append(json.loads(data))
        elif self.open and self.open[-1] != "style":
            self.words.append(data)


def read_page(page):
    """Read a page that must be well-formed and load nothing from elsewhere."""
    found = Reader(page)
    for address in found.addresses:
        assert address.startswith(("data:image/", "#"))
    style = re.findall(r"<style>(.*?)</style>", page, re.DOTALL)
    assert not any(word in each for each in style for word in ("url(", "@import"))
    assert len(found.ids) == len(set(found.ids))
    return found


def unpack(head, text):
    """Arrays of a pack by name, as a page reads them."""
    raw = np.frombuffer(zlib.decompress(b64decode(text)), np.uint8)
    found, start = {}, 0
    for each in head:
        count = int(np.prod(each["shape"]))
        planes = raw[start : start + 4 * count].reshape(4, count)
        folded = np.ascontiguousarray(planes.T).view("<u4").reshape(each["shape"]).astype(np.int64)
        whole = np.cumsum((folded >> 1) ^ -(folded & 1), axis=1)
        found[each["name"]] = np.where(whole == -(2**29), np.nan, whole * each["quantum"])
        start += 4 * count
    return found
