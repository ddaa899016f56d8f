"""Numbers packed for a page: there and back, and those that single precision cannot hold."""

import base64

import numpy as np

from bluefoot_mpc.viz.packing import pack


def unpacked(packed):
    return np.frombuffer(base64.b64decode(packed["bdata"]), dtype="<f4")


def test_numbers_come_back_to_seven_digits():
    values = np.array([[0.123456789, -4.0], [np.nan, 1e30]])
    packed = pack(values)
    assert packed["shape"] == "2, 2"
    np.testing.assert_allclose(unpacked(packed), values.ravel(), rtol=1e-7)


def test_what_is_too_great_is_infinite_without_a_warning():
    # Warnings are errors in tests.
    assert unpacked(pack([1e300, -1e300, 2.0])).tolist() == [np.inf, -np.inf, 2.0]
