"""Files of built functions: whole or rebuilt, however many processes write at once.

A library ends in a digest of itself. A damaged file would otherwise not fail
but crash: the system maps a truncated library without complaint.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from bluefoot_mpc.codegen.compiler import CodegenUnavailable

_MAGIC = b"bluefoot-codegen-1:"
_DIGEST_LENGTH = hashlib.sha256().digest_size


def key_of(*parts: str) -> str:
    """Name of a file by the content that it is made from."""
    digest = hashlib.sha256()
    for part in parts:
        data = part.encode()
        digest.update(len(data).to_bytes(8, "little"))
        digest.update(data)
    return digest.hexdigest()[:32]


def is_whole(path: Path) -> bool:
    """True for a library that ends in the right digest of itself."""
    try:
        data = path.read_bytes()
    except OSError:
        return False
    body, tail = data[: -len(_MAGIC) - _DIGEST_LENGTH], data[-len(_MAGIC) - _DIGEST_LENGTH :]
    return tail == _MAGIC + hashlib.sha256(body).digest()


def obtain(path: Path, make: Callable[[Path], None]) -> None:
    """Leave a whole library at `path`, made by `make(target)` if it is not there yet.

    Of many processes one builds and the others wait for it; a reader never
    sees half a file, because it is written beside its place and then renamed.

    Raises:
        CodegenUnavailable: the folder cannot be written, or `make` failed.
    """
    if is_whole(path):
        return
    try:
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        with _locked(path.with_suffix(".lock")):
            if not is_whole(path):
                _make(path, make)
    except OSError as error:
        raise CodegenUnavailable(f"cannot write {path.parent}: {error.strerror or error}") from error


def _make(path: Path, make: Callable[[Path], None]) -> None:
    handle, name = tempfile.mkstemp(prefix=path.stem, suffix=".tmp", dir=path.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        make(temporary)
        digest = hashlib.sha256(temporary.read_bytes()).digest()
        with temporary.open("ab") as file:
            file.write(_MAGIC + digest)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Hold a lock file; where the file system knows no locks, go on without."""
    with path.open("ab") as file:
        with contextlib.suppress(OSError):
            fcntl.flock(file, fcntl.LOCK_EX)
        yield
