"""``bluefoot world``: plans told, written and drawn."""

import json

import pytest

from bluefoot_mpc.cli.main import main
from bluefoot_mpc.sim.worlds.files import read_plan
from bluefoot_mpc.sim.worlds.make import KINDS, make_plan


def run(capfd, *words):
    status = main(["world", *words, "--json"])
    return status, json.loads(capfd.readouterr().out)


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_told(capfd, kind):
    status, data = run(capfd, kind, "--seed", "2")
    assert status == 0
    assert data["plan"]["name"] == kind
    assert len(data["plan"]["solids"]) == len(make_plan(kind, 2).solids)
    assert data["reachable_m2"] > 15.0


def test_page_tells_what_stands_where_and_how_to_go_there(capsys):
    assert main(["world", "chairs", "--seed", "1"]) == 0
    text = capsys.readouterr().out
    assert "4 walls" in text
    assert "1 table," in text
    assert "bluefoot run wander --world chairs --seed 1" in text
    assert main(["world", "hidden"]) == 0
    text = capsys.readouterr().out
    assert "marker at x" in text
    assert "bluefoot run approach" in text


OWN = """
bounds = [-2.0, -2.0, 4.0, 2.0]
[marker]
x = 3.5
y = 1.0
"""
BAR = """
[[solids]]
name = "{}"
shape = "box"
x = {}
y = 0.0
z = {}
size = [0.1, 1.0, 0.1]
"""


def own_world(tmp_path, *bars):
    file = tmp_path / "own.toml"
    file.write_text(OWN + "".join(BAR.format(*bar) for bar in bars))
    return str(file)


def test_things_that_the_lidar_cannot_see_are_told(capfd, tmp_path):
    bars = [("bar", 1.2, 0.05), ("rail", 1.6, 0.25), ("shelf", 2.0, 0.35), ("lamp", 2.4, 0.6)]
    status, data = run(capfd, own_world(tmp_path, *bars))
    assert status == 0
    below, above = data["warnings"]
    assert below.startswith("warning: 'bar' lies below the LIDAR's plane, 0.25 m above the floor")
    assert above.startswith("warning: 'shelf' lies above")
    assert main(["world", own_world(tmp_path, *bars)]) == 0
    assert "may walk into it" in " ".join(capfd.readouterr().out.split())


@pytest.mark.parametrize("kind", KINDS)
def test_worlds_that_are_made_warn_of_nothing(capfd, kind):
    assert run(capfd, kind, "--seed", "1")[1]["warnings"] == []


def test_own_things_are_counted_by_their_names(capsys, tmp_path):
    assert main(["world", own_world(tmp_path, ("w0", 1.2, 0.25), ("w1", 2.4, 0.25))]) == 0
    text = capsys.readouterr().out
    assert "2 solids: 2 × w" in text
    assert "bluefoot run approach" in text
    assert main(["world", own_world(tmp_path, ("crate", 1.2, 0.25))]) == 0
    assert "1 solid: 1 crate" in capsys.readouterr().out


def test_file_is_written_and_can_be_read_again(capfd, tmp_path):
    file = tmp_path / "sub" / "mine.toml"
    assert run(capfd, "dead_ends", "--seed", "4", "--out", str(file))[0] == 0
    assert read_plan(file) == make_plan("dead_ends", 4)
    status, data = run(capfd, str(file))
    assert (status, data["plan"]["name"]) == (0, "dead_ends")


@pytest.mark.parametrize(
    ("name", "start"), [("w.png", b"\x89PNG"), ("w.svg", b"<?xml"), ("w.html", b"<!doctype html>")]
)
def test_pictures(capfd, tmp_path, name, start):
    file = tmp_path / name
    assert run(capfd, "hidden", "--picture", str(file))[1]["files"] == [str(file)]
    assert file.read_bytes().startswith(start)


def test_page_draws_every_solid_and_the_marker(capfd, tmp_path):
    file = tmp_path / "w.html"
    run(capfd, "hidden", "--picture", str(file))
    text = file.read_text(encoding="utf-8")
    assert "screen1" in text
    assert "marker" in text
    assert "hidden, seed 0" in text


@pytest.mark.parametrize(
    ("words", "cause"),
    [
        (["castle"], "unknown world 'castle'"),
        (["flat"], "unknown kind of world 'flat'"),
        (["no.toml"], "no world file"),
        (["room", "--seed", "-1"], "must not be negative"),
        (["room", "--out", "x.txt"], "ends with .toml"),
        (["room", "--picture", "x.gif"], "must end with one of"),
    ],
)
def test_wrong_use_is_told(capfd, words, cause):
    status, data = run(capfd, *words)
    assert status == 2
    assert cause in data["error"]


def test_picture_that_cannot_be_written(capfd, tmp_path):
    (tmp_path / "file").touch()
    status, data = run(capfd, "room", "--picture", str(tmp_path / "file" / "w.png"))
    assert status == 2
    assert "cannot write" in data["error"]


@pytest.mark.parametrize(("kind", "of"), [("rubble", "blocks"), ("stones", "1 end, 1 start,")])
def test_rough_ground_is_told_with_its_heights(capsys, kind, of):
    assert main(["world", kind, "--seed", "2", "--set", "sim.world.terrain_height=0.03"]) == 0
    text = capsys.readouterr().out
    assert of in text
    assert "rough from x = 0.4" in text
    assert "walk in it: bluefoot run rough" in text
    assert f"--world {kind} --seed 2 --set sim.world.terrain_height=0.03" in text
    assert "warning" not in text


def test_rough_ground_is_written_and_drawn(capfd, tmp_path):
    plan, picture, page = (tmp_path / name for name in ("own.toml", "own.png", "own.html"))
    assert run(capfd, "gap", "--out", str(plan), "--picture", str(picture))[0] == 0
    assert read_plan(plan).floor == -0.08
    assert picture.stat().st_size > 5_000
    assert run(capfd, str(plan), "--picture", str(page))[0] == 0
    assert "height (mm)" in page.read_text()


@pytest.mark.parametrize(
    "words", [["--set", "sim.world.name=gap"], ["--set", "control.x=1"], ["--set", "sim=1"]]
)
def test_only_the_world_is_set(capsys, words):
    assert main(["world", "rubble", *words]) == 2
    assert "--set takes values of the world only" in capsys.readouterr().err


def test_a_figure_that_means_nothing_in_the_world_is_refused(capsys):
    assert main(["world", "rubble", "--set", "sim.world.gap=0.1"]) == 2
    assert "take one of: gap, stones" in capsys.readouterr().err
