import casadi as ca
import numpy as np

from bluefoot_mpc.codegen import made_once, memo


def test_makes_equal_content_once_and_other_content_anew(monkeypatch):
    monkeypatch.setattr(memo, "_memo", type(memo._memo)())
    first = made_once(object, "name", (1.0, 2.0))
    assert made_once(object, "name", (1.0, 2.0)) is first
    assert made_once(object, "name", (1.0, 3.0)) is not first


def test_makes_anew_where_the_environment_says_otherwise(monkeypatch):
    monkeypatch.setattr(memo, "_memo", type(memo._memo)())
    monkeypatch.setenv("BLUEFOOT_CODEGEN", "on")
    first = made_once(object, "name")
    monkeypatch.setenv("BLUEFOOT_CODEGEN", "off")
    assert made_once(object, "name") is not first


def test_forgets_what_was_used_least_recently(monkeypatch):
    monkeypatch.setattr(memo, "_memo", type(memo._memo)())
    first, second = made_once(object, 0), made_once(object, 1)
    for number in range(2, memo._KEPT):
        made_once(object, number)
    assert made_once(object, 0) is first  # used again: the second is the oldest now
    made_once(object, memo._KEPT)
    assert made_once(object, 0) is first
    assert made_once(object, 1) is not second
    assert len(memo._memo) == memo._KEPT


def test_two_users_of_one_function_do_not_meet():
    x = ca.SX.sym("x", 2)
    function = made_once(lambda: ca.Function("doubled_for_test", [x], [2.0 * x]), "doubled")
    pairs = []
    for _ in range(2):
        buffer, call = function.buffer()
        given, result = np.zeros(2), np.zeros(2)
        buffer.set_arg(0, given.data)
        buffer.set_res(0, result.data)
        pairs.append((given, result, call, buffer))
    pairs[0][0][:], pairs[1][0][:] = (1.0, 2.0), (3.0, 4.0)
    pairs[0][2]()
    pairs[1][2]()
    assert pairs[0][1].tolist() == [2.0, 4.0]
    assert pairs[1][1].tolist() == [6.0, 8.0]
