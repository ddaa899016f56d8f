"""Generated code: same results bit for bit, built once, and never in the way when it cannot be had."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from bluefoot_mpc.codegen import CodegenConfig, codegen_mode, compiled, compiler_available, function
from bluefoot_mpc.codegen.store import is_whole
from bluefoot_mpc.exceptions import ConfigurationError

needs_compiler = pytest.mark.skipif(not compiler_available(), reason="no C compiler here")


@pytest.fixture
def config(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> CodegenConfig:
    monkeypatch.delenv("BLUEFOOT_CODEGEN", raising=False)
    function._say_once.cache_clear()
    return CodegenConfig(cache=tmp_path / "cache")


def scalar_function(name: str = "waves") -> ca.Function:
    """Products and sums that contraction would change, and the functions of the C library."""
    x = ca.SX.sym("x", 6)
    p = ca.SX.sym("p", 6)
    rows = [x[i] * p[j] + ca.sin(x[j]) * ca.cos(x[j]) - ca.exp(-x[i]) for i in range(6) for j in range(6)]
    sparse = ca.diag(ca.atan2(x, p) + ca.sqrt(x * x + p * p) + ca.tanh(p))
    return ca.Function(name, [x, p], [ca.vertcat(*rows), sparse], ["x", "p"], ["rows", "sparse"])


def matrix_function() -> ca.Function:
    x = ca.MX.sym("x", 6, 6)
    return ca.Function("products", [x], [x @ x.T @ x, ca.sum1(x)], ["x"], ["cube", "sums"])


def call(f: ca.Function, *inputs: np.ndarray) -> list[np.ndarray]:
    """Results through the buffer, as the hot path calls it."""
    buffer, run = f.buffer()
    outputs = [np.zeros(f.sparsity_out(i).nnz()) for i in range(f.n_out())]
    for i, value in enumerate(inputs):
        buffer.set_arg(i, memoryview(value))
    for i, value in enumerate(outputs):
        buffer.set_res(i, memoryview(value))
    run()
    return outputs


@needs_compiler
def test_scalar_results_are_those_of_the_virtual_machine_bit_for_bit(config: CodegenConfig) -> None:
    f = scalar_function()
    g = compiled(f, config)
    assert g.class_name() == "External"
    assert (g.name(), g.name_in(), g.name_out()) == (f.name(), f.name_in(), f.name_out())
    rng = np.random.default_rng(1)
    for _ in range(200):
        x, p = rng.normal(size=6), rng.normal(size=6)
        for a, b in zip(call(f, x, p), call(g, x, p), strict=True):
            assert a.tobytes() == b.tobytes()


@needs_compiler
def test_matrix_functions_agree_too(config: CodegenConfig) -> None:
    f = matrix_function()
    x = np.random.default_rng(2).normal(size=36)
    for a, b in zip(call(f, x), call(compiled(f, config), x), strict=True):
        assert a.tobytes() == b.tobytes()


@needs_compiler
def test_contraction_would_show(tmp_path: Path) -> None:
    """The bit-for-bit test above is able to fail: fused multiply-add changes these very results."""
    if "fma" not in Path("/proc/cpuinfo").read_text(encoding="ascii", errors="ignore").split():
        pytest.skip("no fused multiply-add on this processor")
    fused = CodegenConfig(
        cache=tmp_path, scalar_flags=("-O2", "-mfma"), flags=("-ffp-contract=fast", "-fPIC", "-shared")
    )
    f, rng = scalar_function(), np.random.default_rng(1)
    g = compiled(f, fused)
    inputs = [(rng.normal(size=6), rng.normal(size=6)) for _ in range(50)]
    assert any(call(f, x, p)[0].tobytes() != call(g, x, p)[0].tobytes() for x, p in inputs)


@needs_compiler
def test_second_time_nothing_is_built(config: CodegenConfig, tmp_path: Path) -> None:
    compiled(scalar_function(), config)
    (library,) = (tmp_path / "cache").glob("*.so")
    before = library.stat().st_mtime_ns
    compiled(scalar_function(), config)
    assert [path.stat().st_mtime_ns for path in (tmp_path / "cache").glob("*.so")] == [before]


@needs_compiler
def test_other_content_or_flags_are_other_files(config: CodegenConfig, tmp_path: Path) -> None:
    compiled(scalar_function(), config)
    x = ca.SX.sym("x")
    compiled(ca.Function("waves", [x], [x + 1.0]), config)
    compiled(scalar_function(), CodegenConfig(cache=config.cache, scalar_flags=("-O0",)))
    assert len(list((tmp_path / "cache").glob("*.so"))) == 3


@needs_compiler
@pytest.mark.parametrize("damage", ["truncated", "flipped", "empty", "text"])
def test_damaged_file_is_built_again(config: CodegenConfig, tmp_path: Path, damage: str) -> None:
    """In a new process each, as a damaged library that is mapped already stays mapped."""
    assert compile_in_a_process(config.cache) == "External"
    (library,) = (tmp_path / "cache").glob("*.so")
    data = library.read_bytes()
    library.unlink()  # a new file, as a copy or an interrupted download would leave it
    middle = len(data) // 2
    library.write_bytes(
        {
            "truncated": data[:middle],
            "flipped": data[:middle] + bytes([data[middle] ^ 255]) + data[middle + 1 :],
            "empty": b"",
            "text": b"not a library",
        }[damage]
    )
    assert not is_whole(library)
    assert compile_in_a_process(config.cache) == "External"
    assert is_whole(library)


@needs_compiler
def test_many_processes_may_race(config: CodegenConfig, tmp_path: Path) -> None:
    racers = [subprocess.Popen(command(config.cache), stdout=subprocess.PIPE, text=True) for _ in range(4)]
    assert [racer.communicate()[0].strip() for racer in racers] == ["External"] * 4
    assert len(list((tmp_path / "cache").glob("*.so"))) == 1
    assert not list((tmp_path / "cache").glob("*.tmp"))


def command(cache: Path | None) -> list[str]:
    text = (
        "import casadi as ca, pathlib, sys\n"
        "from bluefoot_mpc.codegen import CodegenConfig, compiled\n"
        "x = ca.SX.sym('x')\n"
        "config = CodegenConfig(cache=pathlib.Path(sys.argv[1]))\n"
        "f = compiled(ca.Function('raced', [x], [ca.sin(x)]), config)\n"
        "assert float(f(0.0)) == 0.0\n"
        "print(f.class_name())\n"
    )
    return [sys.executable, "-c", text, str(cache)]


def compile_in_a_process(cache: Path | None) -> str:
    return subprocess.run(command(cache), capture_output=True, text=True, check=True).stdout.strip()


def test_no_compiler_leaves_the_function_and_says_so_once(
    config: CodegenConfig, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    f = scalar_function()
    assert compiled(f, config) is f
    assert compiled(f, config) is f
    assert [record.message.count("no C compiler") for record in caplog.records] == [1]
    assert not compiler_available(config)
    assert "no C compiler" in codegen_mode(config).reason


@pytest.mark.parametrize(
    ("script", "cause"),
    [
        ("exit 1", "fails"),
        ('case "$1" in -*v*|-dump*) echo fake;; *) echo broken >&2; exit 1;; esac', "broken"),
    ],
)
def test_failing_compiler_leaves_the_function(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, script: str, cause: str
) -> None:
    function._say_once.cache_clear()
    fake = tmp_path / "fakecc"
    fake.write_text(f"#!/bin/sh\n{script}\n", encoding="ascii")
    fake.chmod(fake.stat().st_mode | stat.S_IXUSR)
    f = scalar_function()
    assert compiled(f, CodegenConfig(cache=tmp_path / "cache", compiler=str(fake))) is f
    assert cause in caplog.text
    assert not list((tmp_path / "cache").glob("*.so"))
    assert not list((tmp_path / "cache").glob("*.tmp"))


def test_slow_compiler_is_given_up(tmp_path: Path) -> None:
    fake = tmp_path / "slowcc"
    fake.write_text(
        '#!/bin/sh\ncase "$1" in -*v*|-dump*) echo slow;; *) exec sleep 20;; esac\n', encoding="ascii"
    )
    fake.chmod(0o700)
    f = scalar_function()
    assert compiled(f, CodegenConfig(cache=tmp_path / "cache", compiler=str(fake), timeout=0.2)) is f


def test_unwritable_cache_leaves_the_function(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    function._say_once.cache_clear()
    (tmp_path / "file").write_text("in the way", encoding="ascii")
    config = CodegenConfig(cache=tmp_path / "file" / "cache")
    f = scalar_function()
    assert compiled(f, config) is f
    assert compiler_available() == ("cannot write" in caplog.text)
    assert not codegen_mode(config).generated


def test_switched_off_by_the_environment(config: CodegenConfig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BLUEFOOT_CODEGEN", "off")
    f = scalar_function()
    assert compiled(f, config) is f
    assert codegen_mode(config).reason == "BLUEFOOT_CODEGEN=off"
    assert "virtual machine" in str(codegen_mode(config))
    assert not (config.cache and config.cache.exists())


def test_switch_has_two_positions(config: CodegenConfig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BLUEFOOT_CODEGEN", "maybe")
    with pytest.raises(ConfigurationError, match="Valid: off, on"):
        compiled(scalar_function(), config)


@pytest.mark.parametrize("name", ["double", "sin", "main"])
def test_a_name_that_c_owns_is_refused(config: CodegenConfig, name: str) -> None:
    with pytest.raises(ConfigurationError, match=f"'{name}'"):
        compiled(scalar_function(name), config)


def test_impossible_timeout_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="timeout"):
        CodegenConfig(timeout=0.0)


def test_function_without_c_form_comes_back(config: CodegenConfig) -> None:
    class Python(ca.Callback):
        def __init__(self) -> None:
            ca.Callback.__init__(self)
            self.construct("in_python", {})

        def eval(self, arg: list[ca.DM]) -> list[ca.DM]:
            return [arg[0] * 2.0]

    f = Python()
    assert compiled(f, config)(2.0) == 4.0


@needs_compiler
def test_folder_follows_the_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("BLUEFOOT_CODEGEN", raising=False)
    monkeypatch.setenv("BLUEFOOT_CACHE", str(tmp_path / "named"))
    assert codegen_mode().cache == tmp_path / "named" / "codegen"
    monkeypatch.delenv("BLUEFOOT_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    mode = codegen_mode()
    assert mode.cache == tmp_path / "xdg" / "bluefoot-mpc" / "codegen"
    assert mode.generated
    assert str(mode).startswith("generated C")
    assert os.fspath(mode.cache).startswith(os.fspath(tmp_path))


@needs_compiler
def test_what_is_built_already_stays(config: CodegenConfig) -> None:
    g = compiled(scalar_function(), config)
    assert compiled(g, config) is g
