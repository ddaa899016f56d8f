import dataclasses
import io
import zipfile

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.leveling.narx import Narx, NarxConfig, NarxWeights, load_weights, save_weights
from bluefoot_mpc.leveling.narx import weights as module

INPUT_SCALE, OUTPUT_SCALE = np.array([0.02, 1.0, 10.0]), np.array([5.0, 0.1])


def make(input_scale=INPUT_SCALE, output_scale=OUTPUT_SCALE, **values):
    return Narx(NarxConfig(**{"hidden": (6, 5), "delays": 2, **values}), input_scale, output_scale)


def run(network, seed, learn=True):
    rng = np.random.default_rng(seed)
    values = []
    for _ in range(60):
        network.train(rng.normal(size=2) * OUTPUT_SCALE, learn=learn)
        values.append(network.predict(rng.normal(size=3) * INPUT_SCALE).value)
    return np.array(values)


@pytest.fixture
def trained():
    network = make()
    run(network, 0)
    return network


@pytest.fixture
def path(trained, tmp_path):
    file = tmp_path / "weights.npz"
    save_weights(file, trained.weights)
    return file


def edit(path, **changes):
    with np.load(path) as archive:
        values = dict(archive)
    for key, value in changes.items():
        if value is None:
            del values[key]
        else:
            values[key] = value
    np.savez(path, **values)


@pytest.mark.parametrize("learn", [True, False])
def test_round_trip_predicts_the_same_to_the_bit(trained, path, learn):
    other = make(seed=5)
    other.load_weights(load_weights(path))
    if learn:
        again = make(seed=7)
        again.load_weights(trained.weights)
        np.testing.assert_array_equal(run(other, 1), run(again, 1))
    else:
        trained.forget()
        np.testing.assert_array_equal(run(other, 1, learn=False), run(trained, 1, learn=False))


def test_round_trip_keeps_all(trained, path):
    before, after = trained.weights, load_weights(path)
    assert (after.delays, after.hidden) == (2, (6, 5))
    for name in ("input_scale", "output_scale"):
        np.testing.assert_array_equal(getattr(after, name), getattr(before, name))
    for one, two in zip(before.layers, after.layers, strict=True):
        np.testing.assert_array_equal(one, two)


def test_reset_after_loading_gives_the_first_weights_again(path):
    network = make()
    first = network.weights
    network.load_weights(load_weights(path))
    network.reset()
    np.testing.assert_array_equal(network.weights.layers[0], first.layers[0])


def test_weights_are_a_copy(trained):
    trained.weights.layers[0][:] = np.nan
    assert np.isfinite(trained.weights.layers[0]).all()


def test_loading_ends_a_divergence(trained):
    weights = trained.weights
    wild = make(rate=1e300, rate_max=1e301)
    run(wild, 0)
    assert wild.diverged
    wild.load_weights(weights)
    assert not wild.diverged
    assert wild.mse == 0.0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"version": np.int64(2)}, ("version 2", "wanted is 1", "train")),
        ({"version": np.array([1, 1])}, ("version", "wanted is 1")),
        ({"version": np.array("new")}, ("version new", "wanted is 1")),
        ({"version": None}, ("names no version",)),
        ({"layer_2": None, "delays": None}, ("lacks delays, layer_2",)),
        ({"delays": np.float64(2.0)}, ("delays", "whole number")),
        ({"delays": np.int64(0)}, ("delays = 0",)),
        ({"delays": np.int64(1)}, ("1 delays", "(6, 11)", "(6, 6)")),
        ({"layer_2": np.zeros((5, 8))}, ("(5, 8)", "(5, 7)")),
        ({"layer_3": np.zeros((3, 6))}, ("(3, 6)", "(2, 6)")),
        ({"layer_1": np.zeros(66)}, ("layer_1", "(66,)", "matrix")),
        ({"layer_1": np.zeros((6, 11), dtype=np.float32)}, ("float32", "float64")),
        ({"layer_3": np.full((2, 6), np.nan)}, ("layer_3", "12 weights", "not finite")),
        ({"input_scale": np.array([1.0, 0.0, 1.0])}, ("input_scale[1]", "positive")),
        ({"output_scale": np.array([1.0, np.nan])}, ("output_scale[1]", "positive")),
        ({"input_scale": np.array(["a", "b", "c"])}, ("input_scale",)),
        ({"layer_1": np.array(["x"])}, ("layer_1",)),
    ],
)
def test_a_file_that_does_not_fit_names_cause_and_way_out(path, changes, words):
    edit(path, **changes)
    with pytest.raises(ConfigurationError) as error:
        load_weights(path)
    assert str(path) in str(error.value)
    for word in words:
        assert word in str(error.value)


@pytest.mark.parametrize(
    ("network", "words"),
    [
        ({"hidden": (6, 6)}, ("hidden = (6, 5)", "has (6, 6)")),
        ({"delays": 1}, ("delays = 2", "has 1")),
        ({"input_scale": np.ones(4)}, ("inputs = 3", "has 4")),
        ({"output_scale": np.ones(1)}, ("outputs = 2", "has 1")),
        ({"input_scale": np.array([0.02, 2.0, 10.0])}, ("input_scale[1] = 1", "has 2")),
        ({"output_scale": np.array([5.0, 0.2])}, ("output_scale[1] = 0.1", "has 0.2")),
        ({"weight_bound": 0.5, "weight_scale": 0.01}, ("weight_bound = 0.5", "diverged")),
    ],
)
def test_weights_of_another_network_name_found_and_wanted(path, network, words):
    target = make(**network)
    before = target.weights
    with pytest.raises(ConfigurationError) as error:
        target.load_weights(load_weights(path))
    for word in words:
        assert word in str(error.value)
    for one, two in zip(before.layers, target.weights.layers, strict=True):
        np.testing.assert_array_equal(one, two)


def test_finite_weights_of_infinite_norm_are_refused(path):
    edit(path, layer_3=np.full((2, 6), 1e300))
    with pytest.raises(ConfigurationError, match="norm inf count as diverged"):
        make().load_weights(load_weights(path))


def array_bytes(values):
    stream = io.BytesIO()
    np.save(stream, values)
    return stream.getvalue()


VERSION = array_bytes(np.int64(1))
DAMAGED_MEMBERS = {
    "no magic": b"garbage",
    "empty": b"",
    "header of no Python": VERSION.replace(b"{'descr'", b"{'descr)"),
    "header cut": VERSION.replace(b", }", b"(((").replace(b"()", b"(("),
    "mixed keys": VERSION.replace(b"'fortran_order'", b"b'ortran_order'"),
    "type of no Python": VERSION.replace(b"<i8", b"(1,"),
    "giant shape": VERSION.replace(b"(), }" + 20 * b" ", b"(999999999999999,), }    "),
    "pickled": array_bytes(np.array([{"a": 1}], dtype=object)),
    "cut": VERSION[:-3],
}


@pytest.mark.parametrize("name", DAMAGED_MEMBERS)
def test_a_damaged_member_is_named(path, name):
    member = DAMAGED_MEMBERS[name]
    assert member != VERSION
    with zipfile.ZipFile(path) as archive:
        members = {key: archive.read(key) for key in archive.namelist()}
    with zipfile.ZipFile(path, "w") as archive:
        for key, values in {**members, "version.npy": member}.items():
            archive.writestr(key, values)
    with pytest.raises(
        ConfigurationError, match=r"damaged.*: version cannot be read; copy it again"
    ) as error:
        load_weights(path)
    assert str(path) in str(error.value)
    assert "allow_pickle" not in str(error.value)


def test_an_encrypted_member_is_named(path):
    content = bytearray(path.read_bytes())
    for mark, flags in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        content[content.index(mark) + flags] |= 1
    path.write_bytes(content)
    with pytest.raises(ConfigurationError, match="version cannot be read"):
        load_weights(path)


def test_a_file_of_text_is_told_from_an_archive(path):
    path.write_text("weights = 3\n")
    with pytest.raises(ConfigurationError, match=r"does not begin as an \.npz file") as error:
        load_weights(path)
    assert str(path) in str(error.value)
    assert "pickle" not in str(error.value)


def test_damaged_files(path, tmp_path):
    whole = path.read_bytes()
    for size in (0, 3, 100, len(whole) // 2, len(whole) - 5):
        path.write_bytes(whole[:size])
        with pytest.raises(ConfigurationError, match="damaged or no file of weights"):
            load_weights(path)
    middle = bytearray(whole)
    middle[whole.index(b"layer_1.npy") + 250] ^= 0xFF
    path.write_bytes(middle)
    with pytest.raises(ConfigurationError, match="damaged"):
        load_weights(path)
    path.write_text("weights")
    with pytest.raises(ConfigurationError, match="damaged"):
        load_weights(path)
    np.save(tmp_path / "one.npy", np.zeros(3))
    with pytest.raises(ConfigurationError, match="one array"):
        load_weights(tmp_path / "one.npy")


def test_missing_files_and_folders(tmp_path, trained):
    with pytest.raises(ConfigurationError, match="cannot read weights"):
        load_weights(tmp_path / "none.npz")
    with pytest.raises(ConfigurationError, match="cannot read weights"):
        load_weights(tmp_path)
    with pytest.raises(ConfigurationError, match="cannot write weights"):
        save_weights(tmp_path / "none" / "weights.npz", trained.weights)


def test_saving_is_all_or_nothing(path, trained, monkeypatch):
    before = path.read_bytes()

    def half(stream, **_):
        stream.write(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(module.np, "savez", half)
    with pytest.raises(ConfigurationError, match="No space left"):
        save_weights(path, trained.weights)
    assert path.read_bytes() == before
    assert [file.name for file in path.parent.iterdir()] == [path.name]


def test_weights_must_fit_together(trained):
    with pytest.raises(ConfigurationError, match="do not fit"):
        dataclasses.replace(trained.weights, delays=3)
    assert isinstance(trained.weights, NarxWeights)
