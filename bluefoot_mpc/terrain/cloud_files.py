"""Point clouds as PLY and PCD files: x, y, z and the time of each point.

Written little endian and binary, which every viewer reads; read in that form and as text. Other properties
(colours, normals, faces) are passed over. A file without times reads as of time 0.
"""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bluefoot_mpc.exceptions import BlueFootError, ConfigurationError
from bluefoot_mpc.terrain.cloud import Cloud

_RECORD = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("time", "<f8")])
_PLY_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
_PCD_TYPES = {"F": "f", "I": "i", "U": "u"}
_LONGEST_HEADER = 65536
_MOST_NUMBERS = 1000
"""Of a point; more are a damaged header."""


class CloudFileError(BlueFootError):
    """A file is missing, damaged or no point cloud that this package reads."""


@dataclass(frozen=True, slots=True)
class _Layout:
    """What a file's header says: the records of its points, how they are written, and where they start."""

    record: np.dtype[np.void]
    count: int
    text: bool
    start: int


def write_cloud(path: Path, cloud: Cloud) -> None:
    """Write a cloud, binary, in the format that the name ends on.

    Places are rounded to 32 bits (under 1 micrometre within 8 m), times are kept in 64.

    Args:
        path: ends on .ply or .pcd.
        cloud: what to write.

    Raises:
        CloudFileError: the file cannot be written.
        ConfigurationError: the name ends on something else.
    """
    kind = _kind(path)
    records = np.zeros(len(cloud.time), dtype=_RECORD)
    for column, name in enumerate("xyz"):
        records[name] = cloud.points[:, column]
    records["time"] = cloud.time
    header = _ply_header(len(records)) if kind == ".ply" else _pcd_header(len(records))
    try:
        path.write_bytes(header.encode("ascii") + records.tobytes())
    except OSError as error:
        raise CloudFileError(f"cannot write {path}: {error.strerror or error}") from error


def read_cloud(path: Path) -> Cloud:
    """Read a cloud from a PLY or PCD file, binary (little endian) or text.

    Args:
        path: ends on .ply or .pcd.

    Raises:
        CloudFileError: the file cannot be read, is damaged, or has no x, y and z; says why.
        ConfigurationError: the name ends on something else.
    """
    kind = _kind(path)
    try:
        content = path.read_bytes()
    except OSError as error:
        raise CloudFileError(f"cannot read {path}: {error.strerror or error}") from error
    try:
        layout = _ply_layout(content) if kind == ".ply" else _pcd_layout(content)
        records = _records(content, layout)
    except (ValueError, IndexError, KeyError, OverflowError) as error:
        raise CloudFileError(f"{path} is not a {kind[1:].upper()} file that can be read: {error}") from error
    names = records.dtype.names or ()
    points = np.stack([records[name].astype(np.float64) for name in "xyz"], axis=-1).reshape(-1, 3)
    time = records["time"].astype(np.float64) if "time" in names else np.zeros(len(points))
    return Cloud(points, time)


def _kind(path: Path) -> str:
    if path.suffix.lower() not in {".ply", ".pcd"}:
        raise ConfigurationError(f"cannot tell the format of {path}: the name must end on .ply or .pcd")
    return path.suffix.lower()


def _ply_header(count: int) -> str:
    return (
        "ply\nformat binary_little_endian 1.0\ncomment odometry frame, m; time in s\n"
        f"element vertex {count}\nproperty float x\nproperty float y\nproperty float z\n"
        "property double time\nend_header\n"
    )


def _pcd_header(count: int) -> str:
    return (
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z time\nSIZE 4 4 4 8\n"
        f"TYPE F F F F\nCOUNT 1 1 1 1\nWIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\n"
        f"POINTS {count}\nDATA binary\n"
    )


def _header(content: bytes, last: str) -> tuple[list[list[str]], int]:
    """Words of the header's lines up to the one that starts with `last`, and where what follows starts."""
    lines: list[list[str]] = []
    start = 0
    while start < min(len(content), _LONGEST_HEADER):
        end = content.find(b"\n", start)
        if end < 0:
            break
        words = content[start:end].decode("ascii").split()
        start = end + 1
        if words and words[0] not in {"comment", "obj_info", "#"}:
            lines.append(words)
            if words[0] == last:
                return lines, start
    raise ValueError(f"its header has no line '{last}'")


def _ply_layout(content: bytes) -> _Layout:
    lines, start = _header(content, "end_header")
    if lines[0] != ["ply"] or len(lines) < 2 or lines[1][0] != "format":
        raise ValueError("its header does not start with 'ply' and 'format'")
    form = lines[1][1]
    if form not in {"ascii", "binary_little_endian", "binary_big_endian"}:
        raise ValueError(f"unknown format '{form}'")
    order = ">" if form == "binary_big_endian" else "<"
    elements = [k for k, words in enumerate(lines) if words[0] == "element"]
    if not elements or lines[elements[0]][1] != "vertex":
        raise ValueError("its first element is not 'vertex'")
    properties = lines[elements[0] + 1 : elements[1] if len(elements) > 1 else -1]
    if any(words[1] == "list" for words in properties):
        raise ValueError("a vertex has a list")
    fields = [(words[2], order + _known(_PLY_TYPES, words[1])) for words in properties]
    return _Layout(_record(fields), int(lines[elements[0]][2]), form == "ascii", start)


def _pcd_layout(content: bytes) -> _Layout:
    lines, start = _header(content, "DATA")
    header = {words[0]: words[1:] for words in lines}
    for key in ("FIELDS", "SIZE", "TYPE", "WIDTH", "HEIGHT"):
        if key not in header:
            raise ValueError(f"its header has no line '{key}'")
    form = header["DATA"][0]
    if form not in {"ascii", "binary"}:
        raise ValueError(f"its data are '{form}': write them as 'binary' or 'ascii'")
    names = header["FIELDS"]
    counts = [int(count) for count in header.get("COUNT", ["1"] * len(names))]
    if not 0 < sum(counts) <= _MOST_NUMBERS or min(counts) < 0:
        raise ValueError(f"a point has {sum(counts)} numbers, by its line 'COUNT'")
    fields = []
    for k, (name, size, kind, count) in enumerate(
        zip(names, header["SIZE"], header["TYPE"], counts, strict=True)
    ):
        label = f"_{k}" if name == "_" else name
        fields += [
            (label if n == 0 else f"{label}_{n}", f"<{_known(_PCD_TYPES, kind)}{size}") for n in range(count)
        ]
    points = int(header.get("POINTS", [str(int(header["WIDTH"][0]) * int(header["HEIGHT"][0]))])[0])
    return _Layout(_record(fields), points, form == "ascii", start)


def _known(types: dict[str, str], name: str) -> str:
    if name not in types:
        raise ValueError(f"unknown type '{name}'")
    return types[name]


def _record(fields: list[tuple[str, str]]) -> np.dtype[np.void]:
    try:
        record = np.dtype(fields)
    except TypeError as error:
        raise ValueError(str(error)) from error
    missing = [name for name in "xyz" if name not in (record.names or ())]
    if missing:
        raise ValueError(f"its points have no {', '.join(missing)}")
    return record


def _records(content: bytes, layout: _Layout) -> np.ndarray[tuple[int], np.dtype[np.void]]:
    """(n,) the points as the file has them."""
    if layout.count < 0:
        raise ValueError(f"it says that it has {layout.count} points")
    if not layout.text:
        needed = layout.count * layout.record.itemsize
        if len(content) - layout.start < needed:
            raise ValueError(
                f"{layout.count} points need {needed} bytes, there are {len(content) - layout.start}: "
                "the file is cut short"
            )
        return np.frombuffer(content, dtype=layout.record, count=layout.count, offset=layout.start)
    if layout.count == 0:
        return np.zeros(0, dtype=layout.record)
    lines = content[layout.start :].decode("ascii").strip()
    if layout.count > lines.count("\n") + 1 or not lines:
        raise ValueError(f"{layout.count} points were announced, it has fewer lines: the file is cut short")
    rows = np.loadtxt(io.StringIO(lines), dtype=np.float64, max_rows=layout.count, ndmin=2)
    names = layout.record.names or ()
    if rows.shape != (layout.count, len(names)):
        raise ValueError(f"{layout.count} points of {len(names)} numbers were announced, it has {rows.shape}")
    records = np.zeros(layout.count, dtype=layout.record)
    for column, name in enumerate(names):
        records[name] = rows[:, column]
    return records
