import pytest
from PIL import Image

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.parameters import load_parameters
from bluefoot_mpc.model.rom import RomConfig, study_range_of_motion
from bluefoot_mpc.viz.rom import save_rom_pictures


@pytest.fixture(scope="module")
def study():
    return study_range_of_motion(load_parameters(), RomConfig(points=21, rays=40))


def test_both_pictures_are_written_and_show_something(study, tmp_path):
    files = save_rom_pictures(study, tmp_path / "new" / "folder")
    assert [file.name for file in files] == ["rom_translation.png", "rom_tilt.png"]
    for file in files:
        with Image.open(file) as picture:
            assert min(picture.size) > 600
            assert len(picture.convert("RGB").getcolors(maxcolors=1 << 20)) > 50


def test_folder_that_cannot_be_made_is_named(study, tmp_path):
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(ConfigurationError, match=r"cannot write .*taken"):
        save_rom_pictures(study, tmp_path / "taken")
