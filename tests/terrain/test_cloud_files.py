"""Point clouds as PLY and PCD files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bluefoot_mpc.exceptions import BlueFootError, ConfigurationError
from bluefoot_mpc.terrain.cloud import Cloud
from bluefoot_mpc.terrain.cloud_files import CloudFileError, read_cloud, write_cloud

PLY_TEXT = """ply
format ascii 1.0
comment made by hand
element vertex 2
property float x
property float y
property float z
property uchar red
property double time
element face 1
property list uchar int vertex_indices
end_header
1 2 3 255 0.5
4 5 6 0 1.5
3 0 1 1
"""
PCD_TEXT = """# .PCD v0.7
VERSION 0.7
FIELDS x y z normal _
SIZE 4 4 4 4 1
TYPE F F F F U
COUNT 1 1 1 3 2
WIDTH 2
HEIGHT 1
POINTS 2
DATA ascii
1 2 3 0 0 1 9 9
4 5 6 0 0 1 9 9
"""


def _cloud(n: int = 500) -> Cloud:
    rng = np.random.default_rng(0)
    return Cloud(rng.uniform(-2.0, 2.0, (n, 3)), np.sort(rng.uniform(0.0, 1e6, n)))


@pytest.mark.parametrize("name", ["cloud.ply", "cloud.PCD"])
@pytest.mark.parametrize("n", [0, 1, 500])
def test_what_is_written_is_read(tmp_path: Path, name: str, n: int) -> None:
    """Places to 32 bits, times to the last bit."""
    cloud = _cloud(n)
    write_cloud(tmp_path / name, cloud)
    back = read_cloud(tmp_path / name)
    assert back.points == pytest.approx(cloud.points, abs=1e-6)
    assert (back.time == cloud.time).all()


@pytest.mark.parametrize(("name", "text", "time"), [("a.ply", PLY_TEXT, 1.5), ("a.pcd", PCD_TEXT, 0.0)])
def test_text_with_more_than_points_is_read(tmp_path: Path, name: str, text: str, time: float) -> None:
    """Colours, normals, padding and faces are passed over; without times it is time 0."""
    (tmp_path / name).write_text(text)
    cloud = read_cloud(tmp_path / name)
    assert cloud.points.tolist() == [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]
    assert cloud.time[1] == time


def test_big_endian_ply_is_read(tmp_path: Path) -> None:
    """The header says it, so it costs nothing."""
    header = (
        PLY_TEXT.split("property uchar", maxsplit=1)[0].replace("ascii", "binary_big_endian") + "end_header\n"
    )
    (tmp_path / "a.ply").write_bytes(header.encode() + np.arange(6, dtype=">f4").tobytes())
    assert read_cloud(tmp_path / "a.ply").points.tolist() == [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]


@pytest.mark.parametrize(
    ("name", "content", "cause"),
    [
        ("a.ply", b"", "no line 'end_header'"),
        ("a.ply", b"\x00\xff\x01" * 1000, "no line 'end_header'|ascii"),
        ("a.ply", b"ply\nend_header\n", "does not start with"),
        ("a.ply", PLY_TEXT.replace("ascii", "utf").encode(), "unknown format 'utf'"),
        ("a.ply", PLY_TEXT.replace("property float y\n", "").encode(), "no y"),
        ("a.ply", PLY_TEXT.replace("vertex 2", "vertex 9").encode(), "9|columns"),
        ("a.ply", PLY_TEXT.replace("vertex 2", "vertex two").encode(), "two"),
        ("a.ply", PLY_TEXT.replace("vertex 2", "vertex").encode(), "PLY"),
        ("a.ply", PLY_TEXT.replace("float z", "quad z").encode(), "unknown type 'quad'"),
        ("a.ply", PLY_TEXT.replace("float y", "float x").encode(), "x"),
        ("a.pcd", b"VERSION 0.7\nDATA binary\n", "no line 'FIELDS'"),
        ("a.pcd", PCD_TEXT.replace("ascii", "binary_compressed").encode(), "write them as 'binary'"),
        ("a.pcd", PCD_TEXT.replace("POINTS 2", "POINTS -1").encode(), "-1 points"),
        ("a.pcd", PCD_TEXT.replace("SIZE 4 4 4 4 1", "SIZE 4 4").encode(), "PCD"),
        ("a.pcd", PCD_TEXT.replace("POINTS 2", "POINTS 999999999999").encode(), "cut short"),
        ("a.pcd", PCD_TEXT.replace("COUNT 1", "COUNT 99999999").encode(), "COUNT"),
        ("a.ply", PLY_TEXT[: PLY_TEXT.index("end_header") + 11].encode(), "cut short"),
        ("a.pcd", PCD_TEXT.replace("SIZE 4 4 4 4", "SIZE 4 4 4 3").encode(), "f3|understood"),
    ],
)
def test_a_bad_file_gives_one_clear_error(tmp_path: Path, name: str, content: bytes, cause: str) -> None:
    """It names the file and what is wrong with it."""
    (tmp_path / name).write_bytes(content)
    with pytest.raises(CloudFileError, match=cause) as error:
        read_cloud(tmp_path / name)
    assert name in str(error.value)
    assert isinstance(error.value, BlueFootError)


@pytest.mark.parametrize("name", ["a.ply", "a.pcd"])
def test_a_file_that_is_cut_short_is_an_error(tmp_path: Path, name: str) -> None:
    """A copy that broke off says so."""
    write_cloud(tmp_path / name, _cloud())
    (tmp_path / name).write_bytes((tmp_path / name).read_bytes()[:-1])
    with pytest.raises(CloudFileError, match="cut short"):
        read_cloud(tmp_path / name)


def test_places_and_names_that_cannot_be(tmp_path: Path) -> None:
    """A missing file, a folder that is not there, and an unknown format."""
    with pytest.raises(CloudFileError, match="cannot read"):
        read_cloud(tmp_path / "none.ply")
    with pytest.raises(CloudFileError, match="cannot write"):
        write_cloud(tmp_path / "none" / "a.ply", _cloud(1))
    with pytest.raises(ConfigurationError, match=r"\.ply or \.pcd"):
        write_cloud(tmp_path / "a.xyz", _cloud(1))
