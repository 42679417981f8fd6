import pytest

from motionenv.data.stimuli import Display, PointLightWalker, StimulusSet
from motionenv.errors import MotionError


def test_a_set_is_read_from_toml_and_from_what_was_made(tmp_path):
    (tmp_path / "set.toml").write_text("seconds = 1\n[[people]]\nspeed = 1.5\n[[displays]]\nview = 90\n")
    asked = StimulusSet.read(tmp_path / "set.toml")
    assert asked == StimulusSet(seconds=1, people=(PointLightWalker(speed=1.5),), displays=(Display(view=90),))
    (tmp_path / "stimuli.json").write_text('{"set": ' + asked.model_dump_json() + ', "stimuli": []}')
    assert StimulusSet.read(tmp_path / "stimuli.json") == asked


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ({"displays": [{"veiw": 3}]}, "stimulus set: displays.0.veiw: there is no such field: did you mean view"),
        ({"displays": [{"dots": 16}]}, "displays.0.dots: Input should be less than or equal to 15; got 16"),
        ({"displays": [{"lifetime": 0.2}]}, "lifetime needs fewer dots than 15"),
        ({"displays": [{"contrast": 0}]}, "contrast must make dots differ"),
        ({"displays": [{"contrast": -0.5}]}, "contrast must make dots differ"),
        ({"seconds": 60, "fps": 240}, "seconds · fps must be from 1 to 7200 frames, got 14400"),
        ({"people": [{}] * 50, "displays": [{}] * 9}, "400 stimuli at most, got 450"),
        ({"people": []}, "people: Tuple should have at least 1 item"),
        ({"people": [{"height": 3}]}, "people.0.height: Input should be less than or equal to 2.5; got 3"),
    ],
)
def test_what_is_wrong_is_named(content, told):
    with pytest.raises(MotionError) as refused:
        StimulusSet.of(content)
    assert told in str(refused.value)


def test_grey_levels_go_from_the_background_to_white_or_black():
    levels = [(0, 1, 1.0), (0, 0.5, 0.5), (0.5, 0.5, 0.75), (0.5, -1, 0.0), (1, -0.25, 0.75)]
    for background, contrast, grey in levels:
        assert Display(background=background, contrast=contrast).grey == pytest.approx(grey)
