"""What nobody means, and what would take hours or all memory, is refused at once and by name."""

import os
import time

import pytest

import archfem as af

COLUMN = """
[structure]
shape = "column"
breadth = "1 m"
heights = [1.0]
[model]
fidelity = "rigid"
"""
RING = COLUMN.replace("column", "circular_arch").replace('breadth = "1 m"', "radius = 3")
SOON = 1.0
"""CPU time in which anything is refused [s]; all of these take milliseconds."""


def read(path, text):
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return af.Case.read(path)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (COLUMN + "x = " + "1" * 5000, "is not TOML"),
        (COLUMN + "x = 9223372036854775808", "whole number beyond"),
        (COLUMN + "x = " + "[" * 3000, "more than 20 tables or lists in each other"),
        (COLUMN + "x = " + "{a=" * 3000, "more than 20 tables or lists in each other"),
        ("a." * 20_000 + "b = 1\n", "more than 20 tables or lists in each other"),
        ('"a" . ' * 20_000 + "b = 1\n", "more than 20 tables or lists in each other"),
        ("[" + "a." * 20_000 + "b]\n", "more than 20 tables or lists in each other"),
        (COLUMN.replace("1 m", "1 " + "m" * 2**19), "has 524290 letters"),
        (COLUMN.replace("1 m", "9**9**9**9 m"), "a power no unit has"),
        (COLUMN.replace("1 m", "((9**9)**9)**9 m"), "a power no unit has"),
        (COLUMN.replace("1 m", "m**1e9"), "a power no unit has"),
        (COLUMN + "#" * 2**20, "has 1048.* bytes, and a case file at most 1048576"),
        (b"\xff\xfe" + COLUMN.encode("utf-16-le"), "not UTF-8"),
        ('without = 3\nbase = "base.toml"', 'write \\["section.key", …\\]'),
        (
            RING.replace("heights = [1.0]", "thickness = 0.5\nembrace = 90\nvoussoirs = 10000000"),
            "voussoirs 10000000 is not a whole number from 1 to 10000",
        ),
    ],
    ids=range(15),
)
def test_what_nobody_means_is_refused_at_once(tmp_path, text, says):
    (tmp_path / "base.toml").write_text(COLUMN)
    begun = time.process_time()
    with pytest.raises(af.ArchfemError, match=says) as caught:
        read(tmp_path / "case.toml", text)
    assert time.process_time() - begun < SOON
    assert len(str(caught.value)) < 5000


def test_a_byte_order_mark_is_no_matter(tmp_path):
    assert read(tmp_path / "case.toml", b"\xef\xbb\xbf" + COLUMN.encode()).structure.free == (1,)


def test_a_chain_of_bases_is_refused_where_it_is_long(tmp_path):
    for k in range(3000):
        (tmp_path / f"{k}.toml").write_text(f'base = "{k + 1}.toml"')
    with pytest.raises(af.InvalidInput, match="is the base of 20 files"):
        af.Case.read(tmp_path / "0.toml")


def devices(folder):
    os.mkfifo(folder / "pipe")
    return ["/dev/zero", folder / "pipe", folder]


@pytest.mark.parametrize("read", [af.Case.read, af.Motion.read, af.History.read])
def test_devices_pipes_and_folders_are_no_files(tmp_path, read):
    for path in devices(tmp_path):
        with pytest.raises(af.InvalidInput, match="is a folder, a device or a pipe: give a"):
            read(path)


def test_nor_are_they_drawings_of_a_case(tmp_path):
    os.mkfifo(tmp_path / "pipe.dxf")
    for path in [*devices(tmp_path), tmp_path / "pipe.dxf"]:
        drawn = {"shape": "outlines", "file": str(path), "unit": "m", "snap": 0.01}
        with pytest.raises(af.InvalidInput, match=r"is no drawing|a pipe: give a draw"):
            af.Case.of({"structure": drawn})


def test_counts_beyond_the_room_are_refused_before_they_take_any():
    ring = af.circular_arch(radius=3, thickness=0.5, embrace=90, voussoirs=5)
    with pytest.raises(af.errors.MeshError, match=r"a mesh of 5e.06 cells, and there is room"):
        af.build(ring, cells=(1000, 1000))
    with pytest.raises(af.InvalidInput, match=r"makes 1e.12, and there is room for 10000000"):
        af.Motion.synthetic(duration=1e9, dt=1e-3)
    with pytest.raises(af.InvalidInput, match="there is room for 10000000"):
        af.Motion.synthetic(duration=1.0).resampled(1e-12)
